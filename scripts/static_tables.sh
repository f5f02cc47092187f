#!/bin/sh
# Tables 8.2 to 8.5 and figures 8.3 to 8.6 again, into docs/reproduction/.
# usage: scripts/static_tables.sh FOLDER   with cow.off, horse.off, mannequin.off, dino.off, fandisk.obj, camelhead.off, stanford-bunny.obj
set -eu
[ $# -eq 1 ] || { sed -n 2,3p "$0" >&2; exit 2; }
cd "$(dirname "$0")/.."
program=build/release/bench/batchenc_static_tables
out=docs/reproduction
"$program" table sphere "$1/horse.off" "$1/mannequin.off" "$1/dino.off" "$1/fandisk.obj" "$1/cow.off" "$1/camelhead.off" \
    "$1/stanford-bunny.obj" > "$out/static_table.csv.tmp"
"$program" figures "$1/cow.off" "$1/horse.off" "$1/mannequin.off" "$1/dino.off" "$1/fandisk.obj" sphere > "$out/static_figures.csv.tmp"
mv "$out/static_table.csv.tmp" "$out/static_table.csv"
mv "$out/static_figures.csv.tmp" "$out/static_figures.csv"
python3 scripts/plot_static.py "$out/static_figures.csv" "$out"
