"""Finds sources beyond a number of lines, so that a file is split before it holds two ideas.

Usage: check_file_sizes.py ROOT LIMIT. Prints each with its length, exits 1 if there is one.
"""

import sys
from pathlib import Path


def main():
    root, limit = Path(sys.argv[1]).resolve(), int(sys.argv[2])
    folders = ["src", "tests", "bench", "scripts", "cmake", ".ci"]
    suffixes = {".h", ".cpp", ".py", ".sh", ".cmake", ".txt", ""}
    # A planted tree inside this one is looked at by its own test.
    files = [p for folder in folders for p in sorted((root / folder).rglob("*"))
             if p.is_file() and p.suffix in suffixes and "planted" not in p.relative_to(root).parts]
    if not files:
        sys.exit(f"no sources under {root}")
    long = [(p, count) for p in files if (count := len(p.read_text(encoding="utf-8", errors="replace").splitlines())) > limit]
    for path, count in long:
        print(f"{path.relative_to(root)}: {count} lines, {limit} at most")
    if not long:
        print(f"{len(files)} files, none beyond {limit} lines")
    sys.exit(bool(long))


main()
