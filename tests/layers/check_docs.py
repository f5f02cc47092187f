"""Looks for files that README.md, CONTRIBUTING.md and docs/*.md name and the repository does not have.

Usage: check_docs.py ROOT. Prints what is missing, exits 1 if anything is. A path may be a glob (jobs/*.yaml) and may
have alternatives in braces (core/error.{h,cpp}); paths of headers may leave src/ out as includes do.
"""

import re
import sys
from pathlib import Path

FOLDERS = r"(?:src|tests|docs|jobs|scripts|bench|cmake|\.ci|core|kernels|codecs|io|pipeline|app)"
NAMED = re.compile(r"(?<![\w./~{}-])" + FOLDERS + r"/[\w.*/{},-]*[\w*/}]")
ROOT_FILE = re.compile(r"`((?:[A-Z]\w+\.(?:md|txt|json)|LICENSE|\.clang-\w+|\.gitignore))`")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)")


def alternatives(pattern):
    braces = re.search(r"\{([^{}]*)\}", pattern)
    if not braces:
        return [pattern]
    return [x for word in braces.group(1).split(",")
            for x in alternatives(pattern[:braces.start()] + word + pattern[braces.end():])]


def exists(bases, pattern):
    return all(any(next(base.glob(one.rstrip("/")), None) is not None for base in bases)
               for one in alternatives(pattern))


def main():
    root = Path(sys.argv[1]).resolve()
    docs = sorted([*root.glob("*.md"), *(root / "docs").glob("**/*.md")])
    if not docs:
        sys.exit(f"no documentation under {root}")
    missing = []
    for doc in docs:
        for number, line in enumerate(doc.read_text(encoding="utf-8").splitlines(), 1):
            names = [(name, [root, root / "src"]) for name in NAMED.findall(line)]
            names += [(name, [root, root / "docs"]) for name in ROOT_FILE.findall(line)]
            names += [(name, [doc.parent]) for name in LINK.findall(line) if ":" not in name]
            for name, bases in names:
                # src/io/job_file is the pair of files of that stem.
                if not exists(bases, name) and not ("." not in name and exists(bases, name + ".*")):
                    missing.append(f"{doc.relative_to(root)}:{number}: {name} does not exist")
    print("\n".join(dict.fromkeys(missing)) if missing else f"all files that {len(docs)} documents name exist")
    sys.exit(bool(missing))


main()
