#!/usr/bin/env bash
# Installs what is missing, builds, and runs all tests. Says what failed; else one line.
#
# Usage: scripts/test.sh [CTEST_ARGUMENT...]     such as: scripts/test.sh -R JobFile
# BATCHENC_PRESET chooses another preset than release, such as asan-ubsan.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=${BATCHENC_PRESET:-release}
"$PWD/scripts/build.sh" "$preset"

log=$PWD/build/$preset/test.log
code=0
ctest --preset "$preset" --parallel "$(nproc)" "$@" >"$log" 2>&1 || code=$?
summary=$(grep -E '^[0-9]+% tests passed' "$log" || true)
if [[ $code -ne 0 || -z $summary ]]; then
    # What the failed tests printed; where none failed (a wrong argument, a listing), the end of all of it.
    if grep -q 'The following tests FAILED' "$log"; then
        awk '/^ *[0-9]+\/[0-9]+ Test/ { show = /\*\*\*/ } /^ +Start +[0-9]+:/ { show = 0 } show' "$log" | sed -n '1,80p'
        sed -n '/The following tests FAILED/,/^$/p' "$log"
    else
        tail -n 60 "$log"
    fi
    [[ $code -eq 0 ]] || echo "All output: $log"
fi
[[ -z $summary ]] || echo "$summary"
exit "$code"
