"""Holds every #include under ROOT/src against the include law; prints what breaks it, exits 1 if anything does.

Usage: check_includes.py ROOT
"""

import re
import sys
from pathlib import Path

# Which layers a layer may include. design: core <- kernels <- codecs <- pipeline <- app, core <- io <- pipeline.
LAYERS = {
    "core": {"core"},
    "kernels": {"core", "kernels"},
    "codecs": {"core", "kernels", "codecs"},
    "io": {"core", "io"},
    "pipeline": {"core", "kernels", "codecs", "io", "pipeline"},
    "app": {"core", "kernels", "codecs", "io", "pipeline", "app"},
}
EVERYWHERE = set(LAYERS)
THREADED = {"io", "pipeline", "app"}  # threads enter the others through core/executor.h alone
WITH_FILES = {"io", "pipeline", "app"}

# Headers by pattern (the first that matches counts), the layers that may include them, and single files beside.
LIBRARIES = [
    (r"(oneapi/)?tbb/.*|oneapi/tbb\.h", {"pipeline"}, set()),
    (r"hdf5(_hl)?\.h|H5\w*\.h", {"io"}, set()),
    (r"yaml-cpp/.*", {"io"}, set()),
    (r"xxhash\.h|xxh3\.h", {"io"}, set()),
    (r"(zlib|libdeflate)\.h", {"io"}, set()),
    (r"CLI/.*", {"app"}, set()),
    (r"spdlog/.*|fmt/.*|nlohmann/.*", {"pipeline", "app"}, set()),
    (r"cblas\.h|lapack(e\w*)?\.h|f77blas\.h|openblas\w*\.h", {"kernels"}, {"pipeline/blas_guard"}),
    (r"hwy/.*", {"kernels"}, set()),
    (r"(unsupported/)?Eigen/.*", {"core", "kernels", "codecs", "pipeline"}, set()),
    (r"tl/expected\.hpp", EVERYWHERE, set()),
    (r"thread|future|execution|stop_token|semaphore|latch|barrier|omp\.h|pthread\.h", THREADED, set()),
    (r"fstream|filesystem", WITH_FILES, set()),
    (r"\w+intrin\.h|cpuid\.h", {"kernels", "io", "pipeline"}, set()),
    (r"(sys|linux|netinet)/.*|(unistd|strings|fcntl|poll|termios|sched|malloc|dlfcn|signal)\.h",
     {"io", "pipeline", "app"}, set()),
    (r"[a-z_]+", EVERYWHERE, set()),  # the C++ standard library
]

INCLUDE = re.compile(r"^\s*#\s*include\b\s*(.*?)\s*$")


def problem(root, layer, file, target):
    """Words for what is wrong with one include, or None."""
    quoted = re.match(r'"([^"]*)"', target)
    angled = re.match(r"<([^>]*)>", target)
    if quoted:
        header = quoted.group(1)
        other = header.split("/")[0]
        if other not in LAYERS or header.count("/") < 1 or ".." in header:
            return f'"{header}" is not written "layer/file.h"'
        if other not in LAYERS[layer]:
            return f'"{header}": {layer} may not include {other}'
        if not (root / "src" / header).is_file():
            return f'"{header}" does not exist'
        return None
    if not angled:
        return f"{target}: the file is hidden behind a macro"
    header = angled.group(1)
    if header.split("/")[0] in LAYERS and "/" in header:
        return f"<{header}>: write own headers in quotes"
    for pattern, layers, files in LIBRARIES:
        if re.fullmatch(pattern, header):
            stem = str(file.relative_to(root / "src").with_suffix(""))
            return None if layer in layers or stem in files else f"<{header}>: {layer} may not include it"
    return f"<{header}>: no known library; add it to the law in tests/layers/check_includes.py"


def main():
    root = Path(sys.argv[1]).resolve()
    files = sorted(p for p in (root / "src").rglob("*") if p.suffix in {".h", ".hpp", ".cpp", ".c", ".inc"})
    if not files:
        sys.exit(f"no sources under {root}/src")
    found = []
    for file in files:
        place = file.relative_to(root)
        layer = place.parts[1]
        if layer not in LAYERS:
            found.append(f"{place}:1: no layer")
            continue
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
            match = INCLUDE.match(line)
            if match and (what := problem(root, layer, file, match.group(1))):
                found.append(f"{place}:{number}: {what}")
    print("\n".join(found) if found else f"{len(files)} files keep the include law")
    sys.exit(bool(found))


main()
