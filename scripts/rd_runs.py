"""Runs of the program over settings and clips, kept in a CSV, so that an interrupted run goes on where it was."""
import csv
import fcntl
import itertools
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py

COLUMNS = ("sequence", "method", "setting", "bytes", "bpvf", "bpvf_geometry", "da", "kg", "max_error_relative")
ABSENT = "is not in this version"


def each(key, *values):
    return [{key: value} for value in values]


def settings_of(axes):
    """Settings by their names in the CSV, each a mapping of dotted keys: every combination of the axes' choices."""
    made = {}
    for choice in itertools.product(*axes):
        keys = {key: value for part in choice for key, value in part.items()}
        name = " ".join(f"{key.split('.', 1)[1]}={value}" for key, value in keys.items() if key != "codec.method")
        made[name] = keys
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


def job_text(clip, keys):
    tree = {}
    for key, value in keys.items():
        *levels, last = key.split(".")
        place = tree
        for level in levels:
            place = place.setdefault(level, {})
        place[last] = value
    path = str(Path(clip).resolve()).replace("'", "''")
    return "\n".join(["batchenc: 1", "name: curves", f"input: {{file: '{path}'}}", "output: ./result.h5", "analysis: false"] +
                     [f"{key}: {flow(part)}" for key, part in tree.items()]) + "\n"


def encode(program, threads, clip, keys, read=lambda result: dict(result["metrics"].attrs)):
    """What `read` takes from one result, which goes at once. Raises OSError with the program's last words."""
    with tempfile.TemporaryDirectory(prefix="rd_runs-") as folder:
        job = os.path.join(folder, "job.yaml")
        with open(job, "w") as file:
            file.write(job_text(clip, keys))
        run = subprocess.run([program, job, "--progress", "none", "--log-level", "error", *threads],
                             stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if run.returncode:
            said = [line for line in run.stderr.splitlines() if line.strip()] or [f"exit code {run.returncode}"]
            raise OSError(next((line for line in said if ABSENT in line), said[-1]))
        with h5py.File(os.path.join(folder, "result.h5")) as result:
            return read(result)


def read_rows(path):
    if not Path(path).exists():
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_text(path, text):
    """Whole or not at all."""
    with open(f"{path}.tmp", "w", newline="", encoding="utf-8") as file:
        file.write(text)
    os.replace(f"{path}.tmp", path)


def write_rows(path, columns, rows):
    with open(f"{path}.tmp", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n", extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)
    os.replace(f"{path}.tmp", path)


def lock(folder):
    """Keeps a second process from writing tables of the same folder until this one ends: each writes all that it knows, so that rows of
    the other would be lost. Ends the program where one is at work. Returns what holds the lock."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit(f"another run is writing tables in {folder}")
    return descriptor


class RunTable:
    """Results of settings on clips in a CSV. coders: by the name in the CSV, axes of settings; codec.method is that name unless an
    axis says otherwise. Rows that the CSV has are kept unless again; rows of settings that coders has no longer go."""

    def __init__(self, path, coders, program, threads=(), again=False, columns=COLUMNS):
        self.path, self.program, self.threads, self.again, self.columns = Path(path), program, list(threads), again, columns
        self.coders = {name: settings_of(axes) for name, axes in coders.items()}
        self.rows = {(row["sequence"], row["method"], row["setting"]): row for row in read_rows(path)}
        self.absent, self.done, self.runs = set(), set(), 0
        self.written = -math.inf  # when; the first row is written at once

    def write(self):
        """Sorted by clip, coder and setting, in the order of coders."""
        place = {key: index for index, key in enumerate((name, setting) for name in self.coders for setting in self.coders[name])}
        kept = sorted((key for key in self.rows if key[1:] in place), key=lambda key: (key[0], place[key[1:]]))
        write_rows(self.path, self.columns, [self.rows[key] for key in kept])
        self.written = time.monotonic()

    def of(self, clip, name):
        """Rows of a coder on a clip."""
        return [row for (sequence, method, _), row in self.rows.items() if (sequence, method) == (clip, name)]

    def run(self, clip, name):
        """Measures what is missing of a coder on a clip, given by its path; returns the number of failures."""
        if (clip.stem, name) in self.done:
            return 0
        self.done.add((clip.stem, name))
        wanted = self.coders[name]
        missing = [s for s in wanted if self.again or (clip.stem, name, s) not in self.rows]
        if not missing:
            return 0
        try:
            return self.run_all(clip, name, missing)
        finally:
            self.write()

    def run_all(self, clip, name, missing):
        failures, start, said = 0, time.monotonic(), time.monotonic()
        terminal = sys.stderr.isatty()
        for index, setting in enumerate(missing, 1):
            keys = {"codec.method": name, **self.coders[name][setting]}
            if keys["codec.method"] in self.absent:
                break
            if terminal or time.monotonic() > said + 30:
                said = time.monotonic()
                print(f"\r{clip.stem} {name}: {index} of {len(missing)} ", end="" if terminal else "\n", file=sys.stderr, flush=True)
            try:
                m = encode(self.program, self.threads, clip, keys)
            except (OSError, KeyError) as error:
                if ABSENT in str(error):
                    print(f"left out: this build has no {keys['codec.method']}", file=sys.stderr)
                    self.absent.add(keys["codec.method"])
                    break
                failures += 1
                print(f"{chr(10) if terminal else ''}failed: {clip.stem} {name} {setting}: {error}", file=sys.stderr)
                continue
            self.runs += 1
            row = [clip.stem, name, setting, round(m["bits_total"] / 8), *(f"{m[key]:.6g}" for key in self.columns[4:])]
            self.rows[clip.stem, name, setting] = dict(zip(self.columns, row))
            if time.monotonic() > self.written + 5:
                self.write()
        else:
            print(f"{chr(13) if terminal else ''}{clip.stem} {name}: {len(missing)} of {len(self.coders[name])} run, "
                  f"{failures} failed, {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
        return failures
