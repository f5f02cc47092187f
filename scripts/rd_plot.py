#!/usr/bin/python3
"""Draws rd_CLIP.svg and writes rd_summary.md from rd_curves.csv and peers.csv: rd_plot.py [FOLDER]

FOLDER is docs/reproduction unless given; scripts/rd_curves.py makes rd_curves.csv and calls this. A curve is the lower envelope
of a coder's settings: at each error the smallest rate that reaches it. A rate difference is the mean difference of the logarithms
of two rates over the errors that both curves cover (Bjontegaard), as a percentage.
"""
import sys
from pathlib import Path

import curves
from curves import difference, rate_at
from drawing import Axis, Curve, Marks, draw_curves
from rd_runs import read_rows, write_text

SHOWN_KG = (2e-3, 20.0)  # beyond it curves are cut: nothing is to be seen of the one, nothing is left in the other
COLOURS = {"rtpca": "#d55e00", "splitcoder": "#0072b2", "pdct": "#009e73", "orlpca": "#cc79a7", "rlpca": "#e69f00",
           "static": "#555555"}
# Baselines are dashed.
BASELINES = {"baseline-static": "#555555", "baseline-lpc": "#56b4e9", "baseline-dynapack": "#0072b2", "baseline-angle": "#7a3fa0",
             "baseline-pca": "#e69f00", "baseline-pca-lpc": "#8b5a2b", "baseline-cpca": "#cc79a7", "baseline-coddyac": "#d55e00",
             "baseline-affine": "#009e73", "baseline-octree": "#999999", "baseline-wavelet": "#000000"}
PEERS = {"famc-dct": ("FAMC (DCT)", "M0 -5L5 0L0 5L-5 0Z"),
         "coddyac-estimate": ("CoDDyaC, estimate", "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0Z"),
         "sz3-lorenzo": ("SZ3", "M-4 -4H4V4H-4Z"), "draco-static": ("Draco, a frame each", "M0 -5L5 4H-5Z"),
         "meshopt-delta-zstd": ("meshoptimizer + zstd", "M0 5L5 -4H-5Z"),
         "rlpca-thesis": ("RLPCA in the thesis", "M-4 -4L4 4M-4 4L4 -4")}
RIVALS = ("famc-dct", "coddyac-estimate")  # peers that the summary compares with: those with a curve


def envelope(rows, sequence, method):
    return curves.envelope([row for row in rows if (row["sequence"], row["method"]) == (sequence, method)])


def draw(clip, of_clip, peers):
    shown = [point for curve in of_clip.values() for point in curve if SHOWN_KG[0] <= point[0] <= SHOWN_KG[1]]
    shown = [(kg, bpvf) for kg, bpvf, _ in shown or [point for curve in of_clip.values() for point in curve]]
    shown += [point for points in peers.values() for point in points]
    kgs, rates = [point[0] for point in shown], [point[1] for point in shown]
    lines = [Curve(method, [(bpvf, kg) for kg, bpvf, _ in curve], {**COLOURS, **BASELINES}[method],
                   dash="5 3" if method in BASELINES else "", words=[row["setting"] for _, _, row in curve])
             for method, curve in of_clip.items()]
    marks = [Marks(PEERS[method][0], [(bpvf, kg) for kg, bpvf in points], PEERS[method][1]) for method, points in peers.items()]
    return draw_curves(clip, "towards the lower left is better",
                       Axis("rate: bits a vertex and frame (bpvf)", True, min(rates) / 1.1, max(rates) * 1.1),
                       Axis("error: kg, percent", True, min(kgs) / 1.15, max(kgs) * 1.15), lines, marks)


def percent(value):
    return "" if value is None else "0 %" if abs(value) < 0.5 else f"{value:+.0f} %"


def line(cells):
    return "| " + " | ".join(cells) + " |"


def summary(by_clip, peers):
    """Markdown: rates at two errors, then rate differences clip by clip. by_clip: by clip, then by coder, envelopes."""
    methods = [m for m in (*COLOURS, *BASELINES) if any(m in of_clip for of_clip in by_clip.values())]
    out = ["# Rate and distortion in short", "",
           "Made by `scripts/rd_curves.py` from [rd_curves.csv](rd_curves.csv) and [peers.csv](peers.csv); how to read it is in",
           "[ANIMATION.md](../ANIMATION.md#curves-of-all-coders).", ""]
    for kg in (1.0, 0.1):
        out += [f"## bpvf at a kg of {kg:g} %", "", line(["clip", *methods]), line(["---"] * (len(methods) + 1))]
        for clip, of_clip in by_clip.items():
            rates = {m: rate_at(of_clip.get(m), kg) for m in methods}
            least = min((r for r in rates.values() if r), default=None)
            out.append(line([clip] + ["" if r is None else f"**{r:.3g}**" if r == least else f"{r:.3g}" for r in rates.values()]))
        out.append("")
    out += ["## Mean rate difference at equal kg", "",
            "The coder of the row against that of the column; negative: the row is smaller. Empty: no common range of kg.", ""]
    for clip, of_clip in by_clip.items():
        rivals = {m: envelope(peers, clip, m) for m in RIVALS}
        columns = {**of_clip, **{PEERS[m][0]: curve for m, curve in rivals.items() if curve}}
        out += [f"### {clip}", "", line(["coder", "kg from, to", *(f"against {name}" for name in columns)]),
                line(["---"] * (len(columns) + 2))]
        for method, curve in of_clip.items():
            cells = ["–" if name == method else percent(difference(curve, other)) for name, other in columns.items()]
            out.append(line([method, f"{curve[0][0]:.2g}, {curve[-1][0]:.2g}", *cells]))
        out.append("")
    return "\n".join(out)


def make(folder):
    """Writes the plots and the summary into folder."""
    rows, peers = read_rows(folder / "rd_curves.csv"), read_rows(folder / "peers.csv")
    by_clip = {}
    for clip in sorted({row["sequence"] for row in rows}):
        found = {method: envelope(rows, clip, method) for method in (*COLOURS, *BASELINES)}
        by_clip[clip] = {method: curve for method, curve in found.items() if curve}
    for clip, of_clip in by_clip.items():
        points = {method: [(float(r["kg"]), float(r["bpvf"])) for r in peers if (r["sequence"], r["method"]) == (clip, method)]
                  for method in PEERS}
        write_text(folder / f"rd_{clip}.svg", draw(clip, of_clip, {m: p for m, p in points.items() if p}))
    write_text(folder / "rd_summary.md", summary(by_clip, peers))


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent / "docs/reproduction")
