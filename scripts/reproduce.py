#!/usr/bin/python3
"""Tables and figures of chapters 4 and 8 of the thesis again, with its printed values beside ours: one command, no hand.

reproduce.py FOLDER_OF_CLIPS [--meshes FOLDER] [--only table-4.1,figure-8.9] [--again] [--threads N]
             [--binary BATCHENC] [--bench FOLDER] [--output FOLDER] [--page FILE]
reproduce.py --no-runs [--output FOLDER] [--page FILE]
Runs what is missing on chicken.h5, cowheavy.h5, dance.h5, elephant_gallop.h5 and samba.h5 of the folder, writes CSV and SVG into
docs/reproduction, and docs/REPRODUCTION.md, which says of each table and figure whether it is met, beaten or not. What the CSV
files have is kept unless --again, so that an interrupted run goes on. Without meshes tables 8.2 to 8.5 stay as they are. --only
may name the beginning of names (figure-8.1). --no-runs draws and writes the page from the CSV files alone.
Exit code: 0 all done, 1 some run failed (the others are done), 2 mistake in the command line, 130 or 143 interrupted.
"""
import argparse
import os
import signal
import sys
import time
from pathlib import Path

import rd_plot
from rd_runs import lock
from reproduction import frame_figures, page, rate_figures, split_figures, statements, tables
from reproduction.work import NOT_MEASURED, Work

ROOT = Path(__file__).resolve().parent.parent


def order(item):
    """Tables, figures, section 8.8, each by its numbers."""
    kind, numbers = item.name.split("-", 1)
    return ("table", "figure", "section").index(kind), [int(part) for part in numbers.split("-")[0].split(".")]


ITEMS = sorted([item for module in (tables, split_figures, rate_figures, frame_figures, statements) for item in module.ITEMS], key=order)


def parse(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="folder with the clips (*.h5)")
    parser.add_argument("--meshes", type=Path, help="folder with cow.off, horse.off, mannequin.off, dino.off, fandisk.obj, camelhead.off, "
                                                    "stanford-bunny.obj")
    parser.add_argument("--only", help="tables and figures, with commas: " + ", ".join(item.name for item in ITEMS))
    parser.add_argument("--binary", type=Path, default=ROOT / "build/release/src/app/batchenc", help="the program")
    parser.add_argument("--bench", type=Path, help="folder of batchenc_segmentation_table and the like; without, bench of the program's build")
    parser.add_argument("--threads", help="threads of the program; every processor without")
    parser.add_argument("--again", action="store_true", help="measure anew what the CSV files have")
    parser.add_argument("--no-runs", action="store_true", help="measure nothing")
    parser.add_argument("--output", type=Path, default=ROOT / "docs/reproduction", help="folder of CSV and plots")
    parser.add_argument("--page", type=Path, help="the page; without, REPRODUCTION.md beside the output folder")
    arguments = parser.parse_args(words)
    if arguments.no_runs == bool(arguments.folder):
        parser.error("a folder of clips, or --no-runs")
    if arguments.folder and not any(arguments.folder.glob("*.h5")):
        parser.error(f"no *.h5 in {arguments.folder}")
    if arguments.folder and not arguments.binary.is_file():
        parser.error(f"no program {arguments.binary}: build it, or say --binary")
    arguments.binary = arguments.binary.resolve()
    arguments.bench = (arguments.bench or arguments.binary.parents[2] / "bench").resolve()
    arguments.page = arguments.page or arguments.output.parent / "REPRODUCTION.md"
    wanted = arguments.only.split(",") if arguments.only else [""]
    for word in wanted:
        if not any(item.name.startswith(word) for item in ITEMS):
            parser.error(f"no table or figure of that name: {word}")
    return arguments, [item for item in ITEMS if any(item.name == word for word in wanted)
                       or any(item.name.startswith(word) for word in wanted if not any(other.name == word for other in ITEMS))]


def stop(number, _):
    sys.exit(128 + number)  # runs finally, which writes what is measured


def main():
    arguments, chosen = parse()
    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    arguments.output.mkdir(parents=True, exist_ok=True)
    lock(arguments.output)
    work = Work(arguments.folder, arguments.output, str(arguments.binary), arguments.bench, arguments.meshes,
                ["--threads", arguments.threads] if arguments.threads else [], arguments.again)
    start, failures = time.monotonic(), 0
    for index, item in enumerate([] if arguments.no_runs else chosen, 1):
        print(f"{item.name}, {index} of {len(chosen)}, {time.monotonic() - start:.0f} s so far", file=sys.stderr, flush=True)
        try:
            failures += item.measure(work)
        except OSError as error:
            print(f"failed: {item.name}: {error}", file=sys.stderr)
            failures += 1
    if work.best.runs:
        rd_plot.make(arguments.output)
    reports = [(item, item.report(work)) for item in ITEMS]
    page.write(arguments.page, reports, os.path.relpath(arguments.output, arguments.page.parent))
    open_items = sum(section is None or any(check.ours == NOT_MEASURED for check in section.checks) for _, section in reports)
    print(f"{work.runs} runs, {failures} failed, {time.monotonic() - start:.0f} s; {open_items} of {len(ITEMS)} tables and figures have "
          f"something that is not measured yet; page: {arguments.page}", file=sys.stderr)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
