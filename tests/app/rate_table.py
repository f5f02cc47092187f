"""The committed table of rates and errors: reading, judging and writing it, without running anything."""

import csv
import os
import re

KEYS = ("clip", "codec", "segmentation")
FIGURES = ("bytes", "bpvf", "da", "kg", "max_error")
WORSE, BETTER = 0.005, 0.02


def read_table(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_table(path, rows):
    """Whole or not at all."""
    with open(f"{path}.tmp", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, KEYS + FIGURES, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    os.replace(f"{path}.tmp", path)


def method(row):
    return re.search(r"method: ([\w-]+)", row["codec"]).group(1)


def figures(metrics):
    """A row's figures of a result's metrics, as the table writes them."""
    written = {name: f"{metrics[name]:.6g}" for name in FIGURES[1:]}
    return {"bytes": str(round(metrics["bits_total"] / 8)), **written}


def judge(row, metrics):
    """What is wrong with a result beside its row, a sentence a figure; nothing where all is within the tolerance."""
    if not row["bytes"]:
        return ["the row has no figures: run test_rates.py --update"]
    measured, wrong = {**metrics, "bytes": metrics["bits_total"] / 8}, []
    for name in FIGURES:
        written, found = float(row[name]), float(measured[name])
        change = found / written - 1 if written else float("inf") if found else 0.0
        if not change <= WORSE:  # a NaN is worse
            wrong.append(f"{name} is {found:.6g}, worse than the table's {written:.6g} by {change:.2%}")
        elif change < -BETTER:
            wrong.append(f"{name} is {found:.6g}, better than the table's {written:.6g} by {-change:.2%}: "
                         "run test_rates.py --update")
    return wrong
