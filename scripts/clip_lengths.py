#!/usr/bin/python3
"""Rate and distortion over clip lengths: which bpvf each needs for the da of the first one.

clip_lengths.py BATCHENC CLIP.h5 FOLDER [LENGTHS [COMPONENTS [CODEC]]], for example
clip_lengths.py build/release/src/app/batchenc medley.h5 /tmp/lengths 0,600,1200,auto 10,20,40,80 "frame_bits: 20"
Prints bpvf, da and lengths of clips for every result, then bpvf relative to the first length's at equal da,
interpolated in logarithms.
"""
import json
import math
import os
import subprocess
import sys


def measure(program, clip, folder, lengths, components, codec):
    os.makedirs(folder, exist_ok=True)
    job = os.path.join(folder, "lengths.yaml")
    with open(job, "w") as file:
        file.write(f"batchenc: 1\nname: lengths\ninput: {{file: {os.path.abspath(clip)}}}\n"
                   f"output: './{{length}}-{{components}}.h5'\ncodec: {{method: rlpca{codec}}}\n"
                   f"sweep: {{clips.length: [{', '.join(lengths)}], codec.components: [{', '.join(components)}]}}\n")
    subprocess.run([program, job, "--overwrite", "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
    curves = {}
    for length in lengths:
        for count in components:
            result = os.path.join(folder, f"{length}-{count}.h5")
            text = subprocess.run([program, "info", "--json", result], check=True, stdout=subprocess.PIPE).stdout
            info = json.loads(text)
            frames = [part["frame_count"] for part in info["clips"]]
            metrics = info["metrics"]
            curves.setdefault(length, []).append((metrics["da"], metrics["bpvf"]))
            print(f"length {length:>5}  L {count:>4}  bpvf {metrics['bpvf']:8.4f}  da {metrics['da']:8.4f}  "
                  f"seams {metrics['seam_jump_max']:.3g}  inside {metrics['inner_jump_max']:.3g}  "
                  f"{len(frames)} clips {frames if len(frames) < 12 else ''}")
    return curves


def rate_at(curve, da):
    points = sorted((math.log(d), math.log(b)) for d, b in curve)
    for (x0, y0), (x1, y1) in zip(points, points[1:]):
        if x0 <= math.log(da) <= x1 and x1 > x0:
            return math.exp(y0 + (y1 - y0) * (math.log(da) - x0) / (x1 - x0))
    return math.nan


def main():
    program, clip, folder = sys.argv[1:4]
    lengths = (sys.argv[4] if len(sys.argv) > 4 else "0,64,128,256,auto").split(",")
    components = (sys.argv[5] if len(sys.argv) > 5 else "5,10,20,40").split(",")
    codec = f", {sys.argv[6]}" if len(sys.argv) > 6 else ""
    curves = measure(program, clip, folder, lengths, components, codec)
    for da, bpvf in sorted(curves[lengths[0]]):
        print(f"da {da:8.4f}  " + "  ".join(f"{length}: {rate_at(curves[length], da) / bpvf:.3f}" for length in lengths))


main()
