#!/usr/bin/python3
"""Rate and distortion of PDCT over its settings, beside the static coder, as CSV on stdout.

pdct_table.py BATCHENC DATA FOLDER: DATA holds the clips, FOLDER takes the results.
A line a result: clip, coder, N, bits, keep, bpvf, bpvf_geometry, da, kg.
"""
import json
import os
import subprocess
import sys

CLIPS = ["chicken", "cowheavy", "dance", "samba", "facecap", "gen_flag"]
# Coder: what its job says, what is swept.
BITS = "codec.bits: [6, 8, 10, 12]"
CLUSTERS = "segmentation.clusters: [10, 25, 40]"
CODERS = {
    "pdct-fixed": ("method: pdct", f"{BITS}, codec.keep: [0.02, 0.1, 0.5, 1], {CLUSTERS}"),
    "pdct-rd": ("method: pdct, allocation: rd", f"{BITS}, {CLUSTERS}"),
    "pdct-temporal-fixed": ("method: pdct, transform: temporal", f"{BITS}, {CLUSTERS}"),
    "pdct-temporal-rd": ("method: pdct, transform: temporal, allocation: rd", f"{BITS}, {CLUSTERS}"),
    "static": ("method: static, predictor: weighted", "codec.bits: [6, 7, 8, 9, 10, 11, 12, 13]"),
}


def measure(program, data, folder, clip, coder):
    codec, sweep = CODERS[coder]
    keys = [part.split(":")[0].split(".")[1] for part in sweep.split(", ") if ":" in part]
    place = os.path.join(os.path.abspath(folder), clip, coder)
    os.makedirs(place, exist_ok=True)
    job = os.path.join(place, "job.yaml")
    name = "-".join("{" + key + "}" for key in keys)
    with open(job, "w") as file:
        file.write(f"batchenc: 1\nname: table\ninput: {{file: {os.path.abspath(data)}/{clip}.h5}}\n"
                   f"output: '{place}/{name}.h5'\nanalysis: false\ncodec: {{{codec}}}\nsweep: {{{sweep}}}\n")
    subprocess.run([program, job, "--resume", "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
    for result in sorted(os.listdir(place)):
        if not result.endswith(".h5"):
            continue
        setting = dict(zip(keys, result[:-3].split("-")))
        text = subprocess.run([program, "info", "--json", os.path.join(place, result)], check=True,
                              stdout=subprocess.PIPE).stdout
        m = json.loads(text)["metrics"]
        print(",".join([clip, coder] + [setting.get(key, "") for key in ("clusters", "bits", "keep")] +
                       [f"{m[key]:.5g}" for key in ("bpvf", "bpvf_geometry", "da", "kg")]), flush=True)


def main():
    program, data, folder = sys.argv[1:4]
    print("clip,coder,clusters,bits,keep,bpvf,bpvf_geometry,da,kg")
    for clip in CLIPS:
        for coder in CODERS:
            measure(program, data, folder, clip, coder)


main()
