"""Draws figures 8.3 to 8.6 from the CSV of `batchenc_static_tables figures`: plot_static.py FIGURES.csv FOLDER"""

import csv
import pathlib
import sys
from collections import defaultdict

from drawing import COLOURS, Axis, Curve, draw_curves

AXES = {"8.3": ("exponent", "weighting exponent"), "8.4": ("vertices", "vertices fitted to, at most"),
        "8.5": ("cosine", "least cosine between normals"), "8.6": ("vertices", "vertices fitted to, at most")}


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
        drawn = [Curve(name, sorted(points), COLOURS[k % len(COLOURS)], dots=False) for k, (name, points) in enumerate(lines.items())]
        text = draw_curves(title, "lower is better", Axis(label), Axis("bits a vertex, bending angle"), drawn)
        (pathlib.Path(folder) / f"figure-{figure}.svg").write_text(text)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
