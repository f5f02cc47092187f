#!/usr/bin/python3
"""Rates, errors and bounds of the splitcoder over bits and targets, as CSV.

splitcoder_table.py BATCHENC FOLDER_OF_CLIPS FOLDER, for example
splitcoder_table.py build/release/src/app/batchenc clips /tmp/table > docs/reproduction/splitcoder_table.csv
Every clip is coded with bits 4 to 18 and with largest errors of 1.73e-3, 1.73e-4 and 1.73e-5 of the diagonal. `over_bound` is the
largest distance of a vertex from its source over the bound: never above 1, or the script ends with an error.
"""
import glob
import os
import subprocess
import sys

import h5py
import numpy as np

BITS = range(4, 19)
TARGETS = (1.73e-3, 1.73e-4, 1.73e-5)


def encode(program, clip, folder, codec):
    job, result = os.path.join(folder, "table.yaml"), os.path.join(folder, "table.h5")
    with open(job, "w") as file:
        file.write(f"batchenc: 1\ninput: {{file: {os.path.abspath(clip)}}}\noutput: ./table.h5\nanalysis: false\n"
                   f"codec: {{method: splitcoder, {codec}}}\n")
    subprocess.run([program, job, "--overwrite", "--progress", "none"], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    with h5py.File(result) as file:
        return dict(file["metrics"].attrs)


def main():
    program, clips, folder = sys.argv[1:4]
    os.makedirs(folder, exist_ok=True)
    print("clip,bits,max_error_relative_asked,bpvf,bpvf_geometry,da,kg,max_error_relative,over_bound")
    broken = 0
    for clip in sorted(glob.glob(os.path.join(clips, "*.h5"))):
        with h5py.File(clip) as file:
            positions = file["positions"][...].reshape(-1, 3).astype(np.float64)
        sides = positions.max(axis=0) - positions.min(axis=0)
        diagonal = np.sqrt((sides ** 2).sum())
        settings = [(f"bits: {bits}", bits, "", sides.max() / 2 ** bits) for bits in BITS]
        settings += [(f"target: {{max_error_relative: {part}}}", "", part, part * diagonal) for part in TARGETS]
        for codec, bits, part, bound in settings:
            m = encode(program, clip, folder, codec)
            over = m["max_error"] / bound
            broken += not over <= 1.0 + 1e-12
            name = os.path.splitext(os.path.basename(clip))[0]
            print(f"{name},{bits},{part},{m['bpvf']:.5g},{m['bpvf_geometry']:.5g},{m['da']:.5g},{m['kg']:.5g},"
                  f"{m['max_error_relative']:.5g},{over:.6f}", flush=True)
    sys.exit(1 if broken else 0)


main()
