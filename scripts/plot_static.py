"""Draws figures 8.3 to 8.6 from the CSV of `batchenc_static_tables figures`: plot_static.py FIGURES.csv FOLDER"""

import csv
import math
import pathlib
import sys
from collections import defaultdict

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 640, 400, 60, 170, 40, 50
COLOURS = ("#1b6ca8", "#c8553d", "#4a7c59", "#8f5fa8", "#b58b00", "#5c5c5c")
AXES = {"8.3": ("exponent", "weighting exponent"), "8.4": ("vertices", "vertices fitted to, at most"),
        "8.5": ("cosine", "least cosine between normals"), "8.6": ("vertices", "vertices fitted to, at most")}


def ticks(low, high, most=8):
    size = 10.0 ** (math.floor(math.log10(high - low)) - 1)
    step = next(size * part for part in (1, 2, 5, 10, 20, 50) if (high - low) / (size * part) <= most)
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def draw(title, label, lines):
    xs = [x for points in lines.values() for x, _ in points]
    ys = [y for points in lines.values() for _, y in points]
    low_x, high_x = min(xs), max(xs)
    margin = 0.05 * (max(ys) - min(ys)) or 1.0
    low_y, high_y = min(ys) - margin, max(ys) + margin
    at_x = lambda x: LEFT + (x - low_x) / (high_x - low_x) * (WIDTH - LEFT - RIGHT)
    at_y = lambda y: HEIGHT - BOTTOM - (y - low_y) / (high_y - low_y) * (HEIGHT - TOP - BOTTOM)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="{TOP - 16}" font-size="14">{title}</text>']
    for x in ticks(low_x, high_x):
        out.append(f'<path d="M{at_x(x):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
                   f'<text x="{at_x(x):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{x:g}</text>')
    for y in ticks(low_y, high_y):
        out.append(f'<path d="M{LEFT} {at_y(y):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                   f'<text x="{LEFT - 6}" y="{at_y(y) + 4:.1f}" text-anchor="end">{y:.4g}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 12}" text-anchor="middle">{label}</text>')
    out.append(f'<text x="{-(TOP + HEIGHT - BOTTOM) / 2}" y="16" transform="rotate(-90)" text-anchor="middle">bits a vertex, bending angle</text>')
    for k, (name, points) in enumerate(lines.items()):
        colour = COLOURS[k % len(COLOURS)]
        path = "L".join(f"{at_x(x):.1f} {at_y(y):.1f}" for x, y in sorted(points))
        out.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
        out.append(f'<text x="{WIDTH - RIGHT + 10}" y="{TOP + 16 + 18 * k}" fill="{colour}">{name}</text>')
    return "\n".join(out + ["</svg>"]) + "\n"


def main(table, folder):
    rows = list(csv.DictReader(open(table, newline="")))
    for figure, (column, label) in AXES.items():
        mine = [row for row in rows if row["figure"] == figure]
        lines = defaultdict(list)
        for row in mine:
            name = row["predictor"]
            if figure == "8.6" and name != "touma-gotsman":
                name = f"{name}, exponent {float(row['exponent']):g}"
            lines[name].append((float(row[column]), float(row["normal_bits"])))
        reach = [x for points in lines.values() for x, _ in points]
        for name, points in lines.items():
            if len(points) == 1:  # what does not depend on the axis is a line all along it
                lines[name] = [(min(x for x in reach), points[0][1]), (max(reach), points[0][1])]
        title = f"Figure {figure}: {'mean of all meshes' if figure == '8.6' else mine[0]['meshes']}, 12 bits"
        (pathlib.Path(folder) / f"figure-{figure}.svg").write_text(draw(title, label, lines))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
