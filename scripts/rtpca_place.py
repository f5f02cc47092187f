#!/usr/bin/python3
"""RTPCA's place: one table of what all other coders need at its errors, from the committed CSV files.

rtpca_place.py [--check]
Reads rd_curves.csv, external_peers.csv and peers.csv of docs/reproduction and writes the table that the README shows, in its place.
--check says with exit code 1 whether it would change. Rates are those of the geometry. Curves are lower envelopes, interpolated
in logarithms.
"""
import argparse
import math
import sys
from pathlib import Path

import numpy as np

import curves
from rd_plot import BASELINES, COLOURS, PEERS
from rd_runs import read_rows, write_text

ROOT = Path(__file__).resolve().parent.parent
ERRORS = {"chicken": 0.35, "cowheavy": 0.65, "dance": 0.54, "samba": 0.53}  # kg, percent
NAMES = {"baseline-static": "each frame, parallelogram", "baseline-lpc": "linear prediction in time",
         "baseline-dynapack": "Dynapack", "baseline-angle": "angle-preserving", "baseline-pca": "global PCA",
         "baseline-pca-lpc": "PCA and LPC", "baseline-cpca": "clustered PCA", "baseline-coddyac": "Coddyac, COBRA style",
         "baseline-affine": "affine clusters, FAMC style", "baseline-octree": "octree, D3DMC style",
         "baseline-wavelet": "wavelets in time"}
# External peers, each with the rows of external_peers.csv that it is: the smallest of them counts.
EXTERNAL = {"zstd 3 of rounded differences": ["zstd-3"], "zstd 19 of them": ["zstd-19"],
            "Blosc of them, LZ4": ["blosc-lz4-bytes"], "Blosc of them, zstd": ["blosc-zstd-bits"],
            "meshoptimizer and zstd 19 of them": ["meshoptimizer+zstd-19"], "zfp": ["zfp", "zfp-mesh-order"],
            "fpzip": ["fpzip", "fpzip-mesh-order"], "Draco, each frame": ["draco-10"]}


def by_clip(rows, method):
    """A coder's curves, by clip."""
    found = {}
    for row in rows:
        if row["method"] == method:
            found.setdefault(row["sequence"], []).append(row)
    return {clip: curve for clip, some in found.items() if (curve := curves.envelope(some, rate="bpvf_geometry"))}


def times(ratio):
    return f"{ratio:.2f}" if ratio < 10 else f"{ratio:.0f}"


def against(of_clip, rtpca):
    """How many times RTPCA's rate: on the mean over clips, and where it comes nearest; of curves. None where none are comparable."""
    ratios = {clip: curves.log_ratios(curve, rtpca[clip]) for clip, curve in of_clip.items() if clip in rtpca}
    ratios = {clip: found for clip, found in ratios.items() if found is not None}
    if not ratios:
        return "", ""
    mean = math.exp(np.mean([found.mean() for found in ratios.values()]))
    clip = min(ratios, key=lambda c: ratios[c].min())
    low, high = curves.common_range(of_clip[clip], rtpca[clip])
    kg = np.exp(np.linspace(math.log(low), math.log(high), 200)[ratios[clip].argmin()])
    return times(mean), f"{math.exp(ratios[clip].min()):.2f} ({clip}, kg {kg:.2g})"


def curve_row(name, of_clip, rtpca):
    rates = [curves.rate_at(of_clip.get(clip), kg) for clip, kg in ERRORS.items()]
    return [name, *("" if rate is None else f"{rate:.3g}" for rate in rates), *against(of_clip, rtpca)]


def point_row(name, rows, rtpca):
    """Of coders with a few points a clip. Between them their curve counts, beyond its ends a point that is near."""
    of_clip, rates, ratios = {}, [], []
    for row in rows:
        of_clip.setdefault(row.get("sequence") or row["clip"], []).append((float(row["kg"]), float(row["bpvf"])))
    for clip, kg in ERRORS.items():
        points = sorted(of_clip.get(clip, []))
        near = [rate for error, rate in points if abs(math.log(error / kg)) < math.log(1.25)]
        between = curves.rate_at(points, kg)
        rates.append(f"{between:.3g}" if between else f"{min(near):.3g}" if near else "")
    for clip, points in of_clip.items():
        for kg, rate in points:
            ours = curves.rate_at(rtpca.get(clip), kg)
            if ours:
                ratios.append((rate / ours, clip, kg))
    mean = math.exp(np.mean([math.log(ratio) for ratio, _, _ in ratios]))
    ratio, clip, kg = min(ratios)
    return [name, *rates, times(mean), f"{ratio:.2f} ({clip}, kg {kg:.2g})"]


def speeds(rows):
    """MB/s of coding and of decoding, medians."""
    return [f"{np.median([float(row[key]) for row in rows]):.0f}" for key in ("encode_MB_per_s", "decode_MB_per_s")]


def table(folder):
    rows, external = read_rows(folder / "rd_curves.csv"), read_rows(folder / "external_peers.csv")
    rtpca = by_clip(rows, "rtpca")
    heads = ["coder", *(f"{clip}, kg {kg:g}" for clip, kg in ERRORS.items()), "of rtpca's rate, mean", "least",
             "codes, MB/s", "decodes"]
    lines = [heads, ["---"] * len(heads)]
    for method in COLOURS:
        row = curve_row(method, by_clip(rows, method), rtpca)
        measured = [r for r in external if r["peer"] == f"batchenc-{method}"]
        if method == "rtpca":
            row[-2:] = ["1", ""]
        lines.append(row + (speeds(measured) if measured else ["", ""]))
    for method in BASELINES:
        lines.append(curve_row(f"{NAMES[method]} (`{method}`)", by_clip(rows, method), rtpca) + ["", ""])
    published = read_rows(folder / "peers.csv")
    for method in ("famc-dct", "sz3-lorenzo", "coddyac-estimate"):
        lines.append(point_row(PEERS[method][0], [r for r in published if r["method"] == method], rtpca) + ["", ""])
    for name, kinds in EXTERNAL.items():
        best = {}
        for row in external:
            key = (row["clip"], row["asked"])
            if row["peer"] in kinds and (key not in best or float(row["bpvf"]) < float(best[key]["bpvf"])):
                best[key] = row
        if best:
            lines.append(point_row(name, list(best.values()), rtpca) + speeds(best.values()))
    return ["| " + " | ".join(cells) + " |" for cells in lines]


def in_readme(text, rows):
    """The text with these rows in place of its table of coders."""
    lines = text.split("\n")
    first = next(i for i, line in enumerate(lines) if line.startswith("| coder |"))
    last = next(i for i in range(first, len(lines)) if not lines[i].startswith("|"))
    return "\n".join(lines[:first] + rows + lines[last:])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    readme = ROOT / "README.md"
    text = readme.read_text(encoding="utf-8")
    wanted = in_readme(text, table(ROOT / "docs/reproduction"))
    if check:
        sys.exit(f"{readme} has not what the CSV files give: run {Path(__file__).name}" if wanted != text else 0)
    write_text(readme, wanted)


if __name__ == "__main__":
    main()
