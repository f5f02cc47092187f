#!/usr/bin/env bash
# Installs what is missing, configures a preset and builds it. Silent when all goes well.
#
# Usage: scripts/build.sh [PRESET]     PRESET: release (default), dev, asan-ubsan, tsan, coverage, clang-tidy
# With CI=true in the environment, warnings are errors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=${1:-release}
"$PWD/scripts/install_dependencies.sh"

folder=$PWD/build/$preset
mkdir -p "$folder"
log=$folder/build.log
options=()
if [[ ${CI:-false} == true ]]; then
    options=(-DBATCHENC_WARNINGS_AS_ERRORS=ON)
fi

if ! cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 ||
    ! cmake --build --preset "$preset" --parallel "$(nproc)" >>"$log" 2>&1; then
    grep -E 'FAILED:|error|Error|undefined reference' "$log" | head -n 40 >&2 || true
    echo "The build failed; all of its output: $log" >&2
    exit 1
fi
