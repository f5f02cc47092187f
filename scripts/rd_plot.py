#!/usr/bin/python3
"""Draws rd_CLIP.svg and writes rd_summary.md from rd_curves.csv and peers.csv: rd_plot.py [FOLDER]

FOLDER is docs/reproduction unless given; scripts/rd_curves.py makes rd_curves.csv and calls this. A curve is the lower envelope
of a coder's settings: at each error the smallest rate that reaches it. A rate difference is the mean difference of the logarithms
of two rates over the errors that both curves cover (Bjontegaard), as a percentage.
"""
import csv
import html
import math
import sys
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 860, 560, 66, 216, 44, 56
SHOWN_KG = (2e-3, 20.0)  # beyond it curves are cut: nothing is to be seen of the one, nothing is left in the other
# Okabe and Ito's colours, told apart by all; yellow is left out, too pale on white.
COLOURS = {"rtpca": "#d55e00", "splitcoder": "#0072b2", "pdct": "#009e73", "orlpca": "#cc79a7", "rlpca": "#e69f00",
           "static": "#555555"}
PEERS = {"famc-dct": ("FAMC (DCT)", "M0 -5L5 0L0 5L-5 0Z"),
         "coddyac-estimate": ("CoDDyaC, estimate", "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0Z"),
         "sz3-lorenzo": ("SZ3", "M-4 -4H4V4H-4Z"), "draco-static": ("Draco, a frame each", "M0 -5L5 4H-5Z"),
         "meshopt-delta-zstd": ("meshoptimizer + zstd", "M0 5L5 -4H-5Z"),
         "rlpca-thesis": ("RLPCA in the thesis", "M-4 -4L4 4M-4 4L4 -4")}
RIVALS = ("famc-dct", "coddyac-estimate")  # peers that the summary compares with: those with a curve


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def envelope(rows, sequence, method):
    """Rows of the lower envelope from the smallest error on: each has a smaller rate than all before."""
    points = sorted(((float(row["kg"]), float(row["bpvf"]), row) for row in rows
                     if (row["sequence"], row["method"]) == (sequence, method) and float(row["kg"]) > 0), key=lambda p: p[:2])
    best, kept = math.inf, []
    for kg, bpvf, row in points:
        if bpvf < best:
            best = bpvf
            kept.append((kg, bpvf, row))
    return kept


def difference(a, b):
    """Mean rate of curve a over that of b at equal error, in percent (negative: a is smaller); None without a common range."""
    if len(a) < 2 or len(b) < 2:
        return None
    low, high = max(a[0][0], b[0][0]), min(a[-1][0], b[-1][0])
    if low >= high:
        return None
    grid = np.linspace(math.log(low), math.log(high), 200)
    rate = [np.interp(grid, [math.log(p[0]) for p in curve], [math.log(p[1]) for p in curve]) for curve in (a, b)]
    return 100 * (math.exp((rate[0] - rate[1]).mean()) - 1)


def rate_at(curve, kg):
    """Rate of a curve at an error, interpolated in logarithms; None beyond its ends."""
    if not curve or not curve[0][0] <= kg <= curve[-1][0]:
        return None
    return math.exp(np.interp(math.log(kg), [math.log(p[0]) for p in curve], [math.log(p[1]) for p in curve]))


def ticks(low, high):
    """1, 2 and 5 times powers of ten from low to high."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [x for decade in decades for part in (1, 2, 5) if low <= (x := part * 10.0 ** decade) <= high]


def draw(clip, curves, peers):
    everything = [(x, y) for curve in curves.values() for y, x, _ in curve]
    shown = [(x, y) for x, y in everything if SHOWN_KG[0] <= y <= SHOWN_KG[1]] or everything
    shown += [(x, y) for points in peers.values() for y, x in points]
    low_x, high_x = min(x for x, _ in shown) / 1.1, max(x for x, _ in shown) * 1.1
    low_y, high_y = min(y for _, y in shown) / 1.15, max(y for _, y in shown) * 1.15
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    at_x = lambda x: LEFT + math.log(x / low_x) / math.log(high_x / low_x) * (right - LEFT)
    at_y = lambda y: bottom - math.log(y / low_y) / math.log(high_y / low_y) * (bottom - TOP)
    inside = lambda x, y: low_x <= x <= high_x and low_y <= y <= high_y
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
           'font-family="sans-serif" font-size="12" fill="#222" role="img">',
           f'<title>{html.escape(clip)}: rate and error of every coder</title>',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<clipPath id="plot"><rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}"/></clipPath>',
           f'<text x="{LEFT}" y="{TOP - 18}" font-size="15">{html.escape(clip)}</text>',
           f'<text x="{right}" y="{TOP - 18}" text-anchor="end" fill="#555">towards the lower left is better</text>']
    for x in ticks(low_x, high_x):
        out.append(f'<path d="M{at_x(x):.1f} {TOP}V{bottom}" stroke="{"#bbb" if f"{x:e}"[0] == "1" else "#e6e6e6"}"/>'
                   f'<text x="{at_x(x):.1f}" y="{bottom + 18}" text-anchor="middle">{x:g}</text>')
    for y in ticks(low_y, high_y):
        out.append(f'<path d="M{LEFT} {at_y(y):.1f}H{right}" stroke="{"#bbb" if f"{y:e}"[0] == "1" else "#e6e6e6"}"/>'
                   f'<text x="{LEFT - 7}" y="{at_y(y) + 4:.1f}" text-anchor="end">{y:g}</text>')
    out.append(f'<rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}" fill="none" stroke="#888"/>')
    out.append('<g text-anchor="middle">'
               f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 14}">rate: bits a vertex and frame (bpvf)</text>'
               f'<text x="{-(TOP + bottom) / 2}" y="16" transform="rotate(-90)">error: kg, percent</text></g>')
    legend = TOP + 12
    for method, curve in curves.items():
        colour = COLOURS[method]
        path = "L".join(f"{at_x(x):.1f} {at_y(y):.1f}" for y, x, _ in curve)
        out.append(f'<g clip-path="url(#plot)" fill="{colour}"><path d="M{path}" fill="none" stroke="{colour}" stroke-width="2" '
                   'stroke-linejoin="round"/>')
        out += [f'<circle cx="{at_x(x):.1f}" cy="{at_y(y):.1f}" r="2.4"><title>{method} {html.escape(row["setting"])}: '
                f'{x:.3g} bpvf, kg {y:.3g}</title></circle>' for y, x, row in curve if inside(x, y)]
        out.append("</g>")
        out.append(f'<path d="M{right + 18} {legend - 4}h26" stroke="{colour}" stroke-width="2"/><circle cx="{right + 31}" '
                   f'cy="{legend - 4}" r="2.4" fill="{colour}"/><text x="{right + 52}" y="{legend}">{method}</text>')
        legend += 20
    legend += 12
    for method, points in peers.items():
        name, shape = PEERS[method]
        for x, y in [(at_x(x), at_y(y)) for y, x in points] + [(right + 31, legend - 4)]:
            out.append(f'<path d="{shape}" transform="translate({x:.1f} {y:.1f})" fill="white" fill-opacity="0.8" stroke="#222" '
                       'stroke-width="1.3"/>')
        out.append(f'<text x="{right + 52}" y="{legend}">{name}</text>')
        legend += 20
    return "\n".join(out + ["</svg>"]) + "\n"


def percent(value):
    return "" if value is None else "0 %" if abs(value) < 0.5 else f"{value:+.0f} %"


def line(cells):
    return "| " + " | ".join(cells) + " |"


def summary(curves, peers):
    """Markdown: rates at two errors, then rate differences clip by clip. curves: by clip, then by coder, envelopes."""
    methods = [m for m in COLOURS if any(m in of_clip for of_clip in curves.values())]
    out = ["# Rate and distortion in short", "",
           "Made by `scripts/rd_curves.py` from [rd_curves.csv](rd_curves.csv) and [peers.csv](peers.csv); how to read it is in",
           "[ANIMATION.md](../ANIMATION.md#curves-of-all-coders).", ""]
    for kg in (1.0, 0.1):
        out += [f"## bpvf at a kg of {kg:g} %", "", line(["clip", *methods]), line(["---"] * (len(methods) + 1))]
        for clip, of_clip in curves.items():
            rates = {m: rate_at(of_clip.get(m), kg) for m in methods}
            least = min((r for r in rates.values() if r), default=None)
            out.append(line([clip] + ["" if r is None else f"**{r:.3g}**" if r == least else f"{r:.3g}" for r in rates.values()]))
        out.append("")
    out += ["## Mean rate difference at equal kg", "",
            "The coder of the row against that of the column; negative: the row is smaller. Empty: no common range of kg.", ""]
    for clip, of_clip in curves.items():
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
    """Writes the plots and the summary into folder, prints the summary."""
    rows, peers = read(folder / "rd_curves.csv"), read(folder / "peers.csv") if (folder / "peers.csv").exists() else []
    curves = {}
    for clip in sorted({row["sequence"] for row in rows}):
        found = {method: envelope(rows, clip, method) for method in COLOURS}
        curves[clip] = {method: curve for method, curve in found.items() if curve}
    for clip, of_clip in curves.items():
        points = {method: [(float(r["kg"]), float(r["bpvf"])) for r in peers if (r["sequence"], r["method"]) == (clip, method)]
                  for method in PEERS}
        (folder / f"rd_{clip}.svg").write_text(draw(clip, of_clip, {m: p for m, p in points.items() if p}))
    text = summary(curves, peers)
    (folder / "rd_summary.md").write_text(text)
    print(text)


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent / "docs/reproduction")
