"""Figures 8.7 and 8.8: bits of tangential components and bending angles by the splitcoder's predictors at gates."""
import curves
from drawing import Axis, Curve, draw_curves
from reproduction.work import Check, Item, Section, at_least, gain_words, number, table

COLOURS = {"time": "#0072b2", "space": "#d55e00", "space-multiway": "#e69f00", "space-time": "#009e73",
           "space-time-multiway": "#cc79a7"}
# What `time` saves at most, as the text states it: (part, against, percent).
STATED = {"8.7": ("cowheavy", [("tangential", "space-time", 41), ("tangential", "space-time-multiway", 41), ("tangential", "space", 52),
                               ("tangential", "space-multiway", 52), ("normal", "space-time", 52)]),
          "8.8": ("dance", [("tangential", "space-time", 46), ("tangential", "space-time-multiway", 46), ("tangential", "space", 59),
                            ("tangential", "space-multiway", 59), ("normal", "space-time", 65)])}
STATED_LEAST = {("8.7", "tangential", "space-time"): 26, ("8.7", "tangential", "space-time-multiway"): 26,
                ("8.7", "tangential", "space"): 31, ("8.7", "tangential", "space-multiway"): 31}


def measure(figure):
    clip = STATED[figure][0]
    return lambda work: work.bench_table("split_table.csv", "clip", [c for c in ("cowheavy", "dance") if c == clip and c in work.clips],
                                         lambda name: ["batchenc_split_tables", "parts", work.clips[name]])


def part_curves(rows, part):
    """Curves of da and bits by predictor; the other component's predictor stays `time`."""
    varied, fixed = ("predictor", "normal") if part == "tangential" else ("normal", "predictor")
    names = [name for name in COLOURS if any(row[varied] == name for row in rows)]
    return {name: curves.envelope([row for row in rows if row[varied] == name and row[fixed] == "time"], "da", f"{part}_bits")
            for name in names}


def report(figure):
    def make(work):
        clip, stated = STATED[figure]
        rows = [row for row in work.read("split_table.csv") if row["clip"] == clip]
        if not rows:
            return None
        checks, files, lines, by_part = [], [], [], {}
        for letter, part in (("a", "tangential"), ("b", "normal")):
            by_part[part] = found = part_curves(rows, part)
            drawn = [Curve(name, [(bits, da) for da, bits, _ in curve], COLOURS[name], words=[f"{r['bits']} bits" for _, _, r in curve])
                     for name, curve in found.items()]
            work.draw(f"figure-{figure}{letter}.svg", draw_curves(
                f"figure {figure} ({letter}): {clip}, {part}", "towards the lower left is better",
                Axis(f"{part} bits a vertex and frame", True), Axis("da, percent", True), drawn))
            files.append(f"figure-{figure}{letter}.svg")
        for part, against, most in stated:
            gain = curves.gains(by_part[part]["time"], by_part[part].get(against, []))
            least = STATED_LEAST.get((figure, part, against))
            says = f"{least} to {most} %" if least else f"up to {most} %"
            if gain:
                checks.append(Check(f"{part}: time against {against}", says, gain_words(gain), at_least(gain[0], most)))
                lines.append([part, against, says, *(number(value, 2) for value in (gain[2], gain[1], gain[0]))])
        notes = ["What `time` saves at equal da, in percent, over the da that both reach with 8 to 15 bits:",
                 table(["part", "against", "thesis", "ours: least", "mean", "most"], lines)]
        return Section(f"Rate and distortion of each component by predictor, {clip}; the other component is predicted by time.", checks,
                       [*files, "split_table.csv"], notes)
    return make


ITEMS = [Item(f"figure-{figure}", f"Figure {figure}: predictors of the two components, {clip}", measure(figure), report(figure))
         for figure, clip in (("8.7", "cowheavy"), ("8.8", "dance"))]
