#!/usr/bin/python3
"""Rate and distortion of every coder on every clip: a CSV, a plot a clip and a table of rate differences.

rd_curves.py FOLDER_OF_CLIPS [--binary BATCHENC] [--clips a,b] [--methods x,y] [--threads N] [--again] [--output FOLDER]
Runs the settings of CODERS on every *.h5 of the folder, with those coders that the program has, and writes rd_curves.csv,
rd_CLIP.svg and rd_summary.md into docs/reproduction. Rows that the CSV has are kept unless --again, so that an interrupted run
goes on; rows of settings that CODERS has no longer go. Exit code: 0 all done, 1 some job failed (the others are done), 2 mistake
in the command line.
"""
import argparse
import itertools
import subprocess
import sys
from pathlib import Path

import rd_plot
from rd_runs import RunTable, each, known_methods, lock

ROOT = Path(__file__).resolve().parent.parent

RLPCA_BITS = [{"codec.basis_bits": basis, "codec.coefficient_bits": basis, "codec.frame_bits": frame}
              for basis, frame in ((6, 10), (8, 12), (11, 15), (13, 18), (15, 20))]
# Frames finer than the rest cost a third of the rate at coarse bits.
PDCT_BITS = [{"codec.bits": bits, "codec.frame_bits": frame} for bits, frame in
             ((5, 11), (6, 12), (7, 12), (8, 13), (9, 14), (10, 14), (11, 15), (12, 16), (13, 17), (14, 18), (16, 20))]
PCA_BITS = [{"codec.basis_bits": bits, "codec.coefficient_bits": bits} for bits in (10, 14)]
EVEN_BITS = each("codec.bits", 6, 8, 10, 12, 14)
# Coder: axes, each a list of choices of dotted keys; every combination is run.
CODERS = {
    "static": [each("codec.predictor", "weighted"), each("codec.bits", *range(6, 17, 2))],
    "splitcoder": [each("codec.bits", *range(4, 19))],
    "rlpca": [each("segmentation.method", "rigid"), each("segmentation.clusters", 2, 5, 10, 40),
              each("codec.components", 2, 4, 8, 16, 32), RLPCA_BITS],
    "pdct": [each("codec.transform", "temporal"), each("codec.allocation", "rd"), each("segmentation.method", "rigid"),
             each("segmentation.clusters", 2, 5, 10, 20, 40), PDCT_BITS],
    "orlpca": [each("segmentation.method", "rigid"), each("segmentation.clusters", 2, 5, 10, 40),
               each("codec.target.components", 20, 60, 160, 480, 1280), RLPCA_BITS],
    "rtpca": [each("segmentation.method", "rigid"), each("segmentation.clusters", 2, 6, 12, 24),
              each("codec.step", 2e-5, 4.7e-5, 1.1e-4, 2.7e-4, 6.3e-4, 1.5e-3, 3.6e-3, 8.4e-3, 2e-2, 4.7e-2)],
    "baseline-static": [EVEN_BITS],
    "baseline-lpc": [each("codec.lpc_order", 1, 2), EVEN_BITS],
    "baseline-dynapack": [each("codec.predictor", "lorenzo", "replica"), EVEN_BITS],
    "baseline-angle": [EVEN_BITS],
    "baseline-pca": [each("codec.components", 5, 10, 20, 40, 80), PCA_BITS],
    "baseline-pca-lpc": [each("codec.components", 5, 10, 20, 40, 80), PCA_BITS],
    "baseline-cpca": [each("segmentation.clusters", 10, 20), each("codec.components", 5, 12, 30),
                      [{"codec.basis_bits": bits, "codec.coefficient_bits": bits} for bits in (11, 15)]],
    "baseline-coddyac": [each("codec.components", 10, 20, 40, 80), each("codec.bits", 5, 6, 7, 8, 9, 10, 12)],
    "baseline-affine": [each("segmentation.clusters", 20), each("codec.bits", *range(6, 15))],
    "baseline-octree": [each("codec.bits", *range(6, 15))],
    "baseline-wavelet": [each("codec.bits", *range(6, 15))],
}


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder with the clips (*.h5)")
    parser.add_argument("--binary", default=str(ROOT / "build/release/src/app/batchenc"), help="the program")
    parser.add_argument("--clips", help="names of clips without .h5, with commas; all without")
    parser.add_argument("--methods", help="coders, with commas; all that the program has without")
    parser.add_argument("--threads", help="threads of the program; every processor without")
    parser.add_argument("--again", action="store_true", help="make rows again that the CSV has")
    parser.add_argument("--output", type=Path, default=ROOT / "docs/reproduction", help="folder of CSV, plots and summary")
    arguments = parser.parse_args()
    clips = {path.stem: path.resolve() for path in sorted(arguments.folder.glob("*.h5"))}
    if not clips:
        parser.error(f"no *.h5 in {arguments.folder}")
    try:
        known = known_methods(arguments.binary)
    except (OSError, AttributeError, subprocess.CalledProcessError) as error:
        parser.error(f"{arguments.binary} does not say which coders it has: {error}")
    names = arguments.clips.split(",") if arguments.clips else list(clips)
    methods = arguments.methods.split(",") if arguments.methods else [m for m in CODERS if m in known]
    for word in [n for n in names if n not in clips] + [m for m in methods if m not in CODERS or m not in known]:
        parser.error(f"no clip or coder of that name: {word}")
    for method in CODERS:
        if method not in known:
            print(f"left out: this build has no {method}", file=sys.stderr)
    arguments.threads = ["--threads", arguments.threads] if arguments.threads else []
    return arguments, [clips[name] for name in names], methods


def main():
    arguments, clips, methods = parse()
    arguments.output.mkdir(parents=True, exist_ok=True)
    lock(arguments.output)
    table = RunTable(arguments.output / "rd_curves.csv", CODERS, arguments.binary, arguments.threads, arguments.again)
    failures = sum(table.run(clip, method) for clip, method in itertools.product(clips, methods))
    table.write()
    rd_plot.make(arguments.output)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
