#!/usr/bin/python3
"""Rate and distortion of every coder on every clip: a CSV, a plot a clip and a table of rate differences.

rd_curves.py FOLDER_OF_CLIPS [--binary BATCHENC] [--clips a,b] [--methods x,y] [--threads N] [--again] [--output FOLDER]
Runs the settings of CODERS on every *.h5 of the folder, with those coders that the program has, and writes rd_curves.csv,
rd_CLIP.svg and rd_summary.md into docs/reproduction. Rows that the CSV has are kept unless --again, so that an interrupted run
goes on; rows of settings that CODERS has no longer go. Exit code: 0 all done, 1 some job failed (the others are done), 2 mistake
in the command line.
"""
import argparse
import csv
import itertools
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py

import rd_plot

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = ["sequence", "method", "setting", "bytes", "bpvf", "bpvf_geometry", "da", "kg", "max_error_relative"]


def each(key, *values):
    return [{key: value} for value in values]


RLPCA_BITS = [{"codec.basis_bits": basis, "codec.coefficient_bits": basis, "codec.frame_bits": frame}
              for basis, frame in ((6, 10), (8, 12), (11, 15), (13, 18), (15, 20))]
# Frames finer than the rest cost a third of the rate at coarse bits.
PDCT_BITS = [{"codec.bits": bits, "codec.frame_bits": frame} for bits, frame in
             ((5, 11), (6, 12), (7, 12), (8, 13), (9, 14), (10, 14), (11, 15), (12, 16), (13, 17), (14, 18), (16, 20))]
# Coder: axes, each a list of choices of dotted keys; every combination is run.
CODERS = {
    "static": [each("codec.predictor", "weighted"), each("codec.bits", *range(6, 17, 2))],
    "splitcoder": [each("codec.bits", *range(4, 19))],
    "rlpca": [each("segmentation.method", "rigid"), each("segmentation.clusters", 5, 10, 40),
              each("codec.components", 2, 4, 8, 16, 32), RLPCA_BITS],
    "pdct": [each("codec.transform", "temporal"), each("codec.allocation", "rd"), each("segmentation.method", "rigid"),
             each("segmentation.clusters", 5, 10, 20, 40), PDCT_BITS],
    "orlpca": [each("segmentation.method", "rigid"), each("segmentation.clusters", 5, 10, 40),
               each("codec.target.components", 20, 60, 160, 480, 1280), RLPCA_BITS],
    "rtpca": [each("segmentation.method", "rigid"), each("segmentation.clusters", 6, 12, 24),
              each("codec.step", 2e-5, 4.7e-5, 1.1e-4, 2.7e-4, 6.3e-4, 1.5e-3, 3.6e-3, 8.4e-3, 2e-2, 4.7e-2)],
}


def settings(method):
    """Settings of a coder by their names in the CSV, each a mapping of dotted keys."""
    made = {}
    for choice in itertools.product(*CODERS[method]):
        keys = {key: value for part in choice for key, value in part.items()}
        made[" ".join(f"{key.split('.', 1)[1]}={value}" for key, value in keys.items())] = keys
    return made


def known_methods(program):
    text = subprocess.run([program, "--help-job"], check=True, stdout=subprocess.PIPE, text=True).stdout
    words = re.search(r"codec\.method\s(.*?);", text, re.DOTALL).group(1)
    return re.findall(r"[\w-]+", re.sub(r"\(later:.*?\)", "", words, flags=re.DOTALL))


def flow(value):
    """YAML in flow style of nested mappings, numbers and plain words."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(part)}" for key, part in value.items()) + "}"
    return str(value)


def job_text(clip, method, keys):
    tree = {"codec": {"method": method}}
    for key, value in keys.items():
        *levels, last = key.split(".")
        place = tree
        for level in levels:
            place = place.setdefault(level, {})
        place[last] = value
    path = str(clip).replace("'", "''")
    return "\n".join(["batchenc: 1", "name: curves", f"input: {{file: '{path}'}}", "output: ./result.h5", "analysis: false"] +
                     [f"{key}: {flow(part)}" for key, part in tree.items()]) + "\n"


def measure(program, threads, clip, method, keys):
    """Metrics of one result; the result goes as soon as they are read. Raises OSError with the program's last words."""
    with tempfile.TemporaryDirectory(prefix="rd_curves-") as folder:
        job = os.path.join(folder, "job.yaml")
        with open(job, "w") as file:
            file.write(job_text(clip, method, keys))
        run = subprocess.run([program, job, "--progress", "none", "--log-level", "error", *threads],
                             stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if run.returncode:
            raise OSError((run.stderr.strip().splitlines() or [f"exit code {run.returncode}"])[-1])
        with h5py.File(os.path.join(folder, "result.h5")) as result:
            return dict(result["metrics"].attrs)


def read(path):
    if not path.exists():
        return {}
    with open(path, newline="") as file:
        return {(row["sequence"], row["method"], row["setting"]): row for row in csv.DictReader(file)}


def write(path, rows):
    """Sorted by clip, coder and setting, in the order of CODERS; whole or not at all."""
    wanted = [(method, setting) for method in CODERS for setting in settings(method)]
    place = {key: index for index, key in enumerate(wanted)}
    kept = sorted((key for key in rows if key[1:] in place), key=lambda key: (key[0], place[key[1:]]))
    with open(f"{path}.tmp", "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows[key] for key in kept)
    os.replace(f"{path}.tmp", path)


def run_coder(arguments, rows, clip, method):
    """Measures what is missing; returns the number of failures."""
    name, wanted = clip.stem, settings(method)
    missing = [s for s in wanted if arguments.again or (name, method, s) not in rows]
    failures, start = 0, time.monotonic()
    for index, setting in enumerate(missing, 1):
        if sys.stderr.isatty():
            print(f"\r{name} {method}: {index} of {len(missing)} ", end="", file=sys.stderr, flush=True)
        rows.pop((name, method, setting), None)
        try:
            m = measure(arguments.binary, arguments.threads, clip, method, wanted[setting])
        except (OSError, KeyError) as error:
            failures += 1
            print(f"{chr(10) if sys.stderr.isatty() else ''}failed: {name} {method} {setting}: {error}", file=sys.stderr)
            continue
        row = [name, method, setting, round(m["bits_total"] / 8)]
        row += [f"{m[key]:.6g}" for key in COLUMNS[4:]]
        rows[name, method, setting] = dict(zip(COLUMNS, row))
    print(f"{chr(13) if sys.stderr.isatty() else ''}{name} {method}: {len(missing)} of {len(wanted)} run, {failures} failed, "
          f"{time.monotonic() - start:.0f} s", file=sys.stderr)
    return failures


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
    table = arguments.output / "rd_curves.csv"
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows, failures = read(table), 0
    for clip, method in itertools.product(clips, methods):
        try:
            failures += run_coder(arguments, rows, clip, method)
        finally:
            write(table, rows)
    rd_plot.make(arguments.output)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
