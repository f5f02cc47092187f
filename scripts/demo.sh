#!/usr/bin/env bash
# Shows the whole way on a machine that has nothing yet: installs what is missing, builds, makes three sample clips,
# encodes jobs/*.yaml, decodes and verifies every result, and prints a table. All files go to demo-output/.
#
# Usage: scripts/demo.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

"$PWD/scripts/build.sh" release
batchenc=$PWD/build/release/src/app/batchenc
clips=$PWD/demo-output/clips
results=$PWD/demo-output/results
decoded=$PWD/demo-output/decoded
log=$PWD/demo-output/demo.log
mkdir -p "$clips" "$decoded"
rm -f "$results"/*.h5 # the table shows this run alone
: >"$log"

# Runs a command with its output in the log; shows the log's end and stops when it fails.
run() {
    echo "\$ $*" >>"$log"
    if ! "$@" >>"$log" 2>&1; then
        tail -n 20 "$log" >&2
        echo "Failed: $*; all output: $log" >&2
        exit 1
    fi
}

make_clip() { # KIND VERTICES FRAMES
    [[ -e $clips/$1.h5 ]] || run "$batchenc" synth "$1" -o "$clips/$1.h5" --vertices "$2" --frames "$3" --seed 1
}
make_clip walker 10000 240
make_clip flag 8000 300
make_clip jelly 12000 150

run "$batchenc" --overwrite --progress none jobs/*.yaml

rows=$PWD/demo-output/rows.txt
: >"$rows"
for result in "$results"/*.h5; do
    name=$(basename "$result" .h5)
    source=$clips/${name%%-*}.h5
    run rm -f "$decoded/$name.h5"
    run "$batchenc" decode "$result" -o "$decoded/$name.h5" --progress none
    verified=ok
    "$batchenc" verify "$result" --source "$source" --progress none >>"$log" 2>&1 || verified=FAILED
    info=$("$batchenc" info "$result" --json)
    printf '%s\t%s\t%s\t%s\n' "$name" "$(stat --format=%s "$result")" "$verified" "$info" >>"$rows"
done

/usr/bin/python3 - "$rows" <<'PYTHON'
import json
import sys

print(f"{'result':<10} {'vertices':>8} {'frames':>6} {'raw MB':>7} {'result kB':>9} {'ratio':>6} "
      f"{'bpvf':>6} {'da %':>8} {'kg %':>8} {'encode MB/s':>11}  verify")
failed = False
for row in open(sys.argv[1], encoding="utf-8"):
    name, size, verified, info = row.rstrip("\n").split("\t", 3)
    header = json.loads(info)
    metrics = {key: float("nan") if value is None else value for key, value in header["metrics"].items()}
    raw = header["vertex_count"] * header["frame_count"] * 12
    print(f"{name:<10} {header['vertex_count']:>8} {header['frame_count']:>6} {raw / 1e6:>7.1f} "
          f"{int(size) / 1e3:>9.1f} {raw / int(size):>6.1f} {metrics['bpvf']:>6.3f} {metrics['da']:>8.4f} "
          f"{metrics['kg']:>8.4f} {raw / 1e6 / metrics['encode_time_s']:>11.0f}  {verified}")
    failed |= verified != "ok"
sys.exit(failed)
PYTHON
echo "Clips, results and decoded clips: demo-output/; what was run: demo-output/demo.log"
