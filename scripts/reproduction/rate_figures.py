"""Figures of rate and distortion: 8.9, 8.10, 8.14 to 8.17, and 8.20 to 8.26."""
import curves
from drawing import Axis, Curve, draw_bars, draw_curves
from reproduction.modes import CLUSTERS, NAMES, STATE_OF_ART, name_of
from reproduction.work import NOT_MEASURED, OPEN, Check, Item, Section, at_least, gain_words, holds, number, percent, table

OUR_MODES = ("rlpca-thesis", "orlpca-thesis", "pdct-thesis", "splitcoder-thesis")
BETTER, CLOSE = "better", "similar"
CLOSE_PERCENT = 10.0  # so much larger at most is what "similar" and "comes close" are held to


def claims(work, clip, coder, stated):
    """Checks of what the text says of a coder against others on a clip, by the mean rate at equal da. stated: {other: BETTER or CLOSE}."""
    checks = []
    for other, says in stated.items():
        change = work.difference(clip, coder, other)
        limit = 0.0 if says == BETTER else CLOSE_PERCENT
        ours = f"rate {percent(change)}" if change is not None else work.missing(clip, coder, other)
        checks.append(Check(f"{clip}: {name_of(coder)} against {name_of(other)}", says, ours,
                            holds(None if change is None else change <= limit)))
    return checks


def differences(work, clip, coders, others):
    """Markdown: mean rate of each coder over others at equal da."""
    return table([f"{clip}: against", *map(name_of, others)],
                 [[name_of(coder), *(percent(work.difference(clip, coder, other)) for other in others)] for coder in coders])


def rate_item(figure, title, shows, panels, stated, coders_of_table):
    """A figure of curves. panels: (letter, clip, which of draw_rates); stated: (clip, coder, {other: claim})."""
    def coders(which):
        return list(dict.fromkeys(one[0] if isinstance(one, tuple) else one for one in which))

    def measure(work):
        return sum(work.run([clip], coders(which)) for _, clip, which in panels)

    def report(work):
        files = [name for letter, clip, which in panels for name in work.draw_rates(f"figure-{figure}{letter}", clip, which)]
        if not files:
            return None
        checks = [check for clip, coder, says in stated for check in claims(work, clip, coder, says)]
        notes = []
        for _, clip, which in panels:
            others = [coder for coder in coders(which) if coder not in coders_of_table]
            ours = [coder for coder in coders_of_table if coder in coders(which)]
            if ours and any(work.curve(clip, coder) for coder in others):
                notes.append(differences(work, clip, ours, others))
        if notes:
            notes.insert(0, "Mean rate at equal da over that of the column, percent; negative: ours is smaller.")
        return Section(shows, checks, files, notes)
    return Item(f"figure-{figure}", title, measure, report)


# Figures 8.10 and 8.20: bars

def gain_item(figure, title, coder, others, at_rate, at_error):
    """Gains of a coder against others on the chicken. at_rate: {other: percent of error saved at most at equal rate, as stated};
    at_error: likewise of rate at equal error."""
    clip = "chicken"

    def report(work):
        ours = work.curve(clip, coder)
        if not ours:
            return None
        checks, rows, panels = [], [], []
        for label, stated, turn in (("error saved at equal rate, mean", at_rate, curves.swapped),
                                    ("rate saved at equal da, mean", at_error, list)):
            bars = []
            for other in others:
                gain = curves.gains(turn(ours), turn(work.curve(clip, other)))
                what = f"{label.split(',')[0]}, against {name_of(other)}"
                if gain:
                    bars.append((name_of(other), max(gain[1], 0.0), NAMES[other][1], f"{gain[1]:.0f} % ({gain[2]:.0f} to {gain[0]:.0f} %)"))
                    rows.append({"comparison": what, "thesis_percent": stated.get(other, ""), "most": f"{gain[0]:.1f}",
                                 "mean": f"{gain[1]:.1f}", "least": f"{gain[2]:.1f}", "from": number(gain[3], 4), "to": number(gain[4], 4)})
                if other in stated:
                    checks.append(Check(what, f"up to {stated[other]} %", gain_words(gain) if gain else work.missing(clip, coder, other),
                                        at_least(gain[0] if gain else None, stated[other])))
            panels.append((label, bars))
        shown = [["comparison", "thesis: up to", "ours: most", "mean", "least", "over"]]
        files = []
        if rows:
            work.write(f"figure-{figure}.csv", rows)
            work.draw(f"figure-{figure}.svg", draw_bars(f"figure {figure}: {name_of(coder)} on {clip}", "longer is better", panels))
            files = [f"figure-{figure}.svg", f"figure-{figure}.csv"]
            shown += [[r["comparison"], r["thesis_percent"], r["most"], r["mean"], r["least"], f"{r['from']} to {r['to']}"] for r in rows]
        return Section(f"What {name_of(coder)} saves on the chicken, over the whole range that both curves have in common: the thesis "
                       "does not print at which rate and error its bars stand.", checks, files, [table(shown[0], shown[1:])] if rows else [])
    return Item(f"figure-{figure}", title, lambda work: work.run([clip], [coder, *others]), report)


# Figures 8.16 and 8.17

def zeroed(work, count):
    """(share of zeroed coefficients in percent, da, rate) of PDCT with 12 bits, from the fewest on."""
    rows = work.rows("chicken", "pdct-thesis", f"clusters={count} bits=12")
    keep = lambda row: float(dict(word.split("=") for word in row["setting"].split())["keep"])
    return sorted((100 * (1 - keep(row)), float(row["da"]), float(row["bpvf_geometry"])) for row in rows)


def zeroed_item(figure, column, label, more_means, says):
    counts = (10, 25, 40)

    def report(work):
        found = {count: zeroed(work, count) for count in counts}
        if not all(found.values()):
            return None
        lines = [Curve(f"{count} clusters", [(point[0], point[column]) for point in points], colour)
                 for (count, points), colour in zip(found.items(), ("#0072b2", "#d55e00", "#009e73"))]
        work.draw(f"figure-{figure}.svg", draw_curves(f"figure {figure}: chicken, 12 bits", "lower is better",
                                                      Axis("coefficients that are zeroed, percent"), Axis(label, True), lines))
        work.write(f"figure-{figure}.csv", [{"clusters": count, "zeroed_percent": f"{p[0]:g}", "da": p[1], "bpvf_geometry": p[2]}
                                            for count, points in found.items() for p in points])
        checks = []
        for count, points in found.items():
            values = [point[column] for point in points]
            slack = 1.01 if more_means == "less" else 0.99  # a step of less than that the other way is none
            steady = all(b >= a * slack if more_means == "more" else b <= a * slack for a, b in zip(values, values[1:]))
            checks.append(Check(f"{count} clusters: {says}", "yes", f"from {values[0]:.3g} to {values[-1]:.3g}", holds(steady)))
        for few, many in zip(counts, counts[1:]):
            pairs = [(a[column], b[column]) for a, b in zip(found[few], found[many])]
            least = [b <= a for a, b in pairs]
            checks.append(Check(f"{many} clusters give less than {few}", "yes", f"at {sum(least)} of {len(least)} shares of coefficients",
                                holds(all(least))))
        return Section(f"PDCT on the chicken, spatial, 12 bits: {label} by the share of coefficients that are zeroed.", checks,
                       [f"figure-{figure}.svg", f"figure-{figure}.csv"])
    return Item(f"figure-{figure}", f"Figure {figure}: zeroed coefficients and {label}",
                lambda work: work.run(["chicken"], ["pdct-thesis"]), report)


# Figure 8.22

def clusters_item():
    panels = [("a", "chicken", (10, 25, 40)), ("b", "dance", (10, 20, 40))]

    def report(work):
        files, checks, rows = [], [], []
        for letter, clip, counts in panels:
            which = [("pdct-thesis", f"clusters={count}", f"{count} clusters") for count in counts]
            files += work.draw_rates(f"figure-8.22{letter}", clip, which)
            curve = {count: work.curve(clip, "pdct-thesis", f"clusters={count}") for count in counts}
            for count in counts[:-1]:
                change = curves.difference(curve[40], curve[count])
                checks.append(Check(f"{clip}: 40 clusters better than {count}", "yes",
                                    NOT_MEASURED if change is None else f"rate {percent(change)}",
                                    holds(None if change is None else change < 0)))
        return Section("PDCT with different numbers of clusters.", checks, files) if files else None
    return Item("figure-8.22", "Figure 8.22: PDCT by the number of clusters",
                lambda work: work.run(["chicken", "dance"], ["pdct-thesis"]), report)


# Figure 8.23

def pictures_item():
    def report(work):
        rows = []
        for count in (10, 40):
            for bits, keep in ((12, "1"), (12, "0.1"), (12, "0.02"), (10, "0.5"), (8, "0.1"), (8, "0.02"), (6, "0.02")):
                for row in work.rows("samba", "pdct-thesis", f"clusters={count} bits={bits} keep={keep}"):
                    rows.append({"clip": "samba", "clusters": count, "bits": bits, "coefficients_percent": f"{100 * float(keep):g}",
                                 "bpvf_geometry": row["bpvf_geometry"], "da": row["da"]})
        if not rows:
            return None
        work.write("figure-8.23.csv", rows)
        shown = table(["clusters", "bits", "coefficients, %", "bpvf", "da"], [[r["clusters"], r["bits"], r["coefficients_percent"],
                                                                         number(r["bpvf_geometry"]), number(r["da"])] for r in rows])
        return Section("The figure shows pictures of the dolphin, which is not to be had, with settings, rates and errors under them. Here is the "
                       "table of settings on samba; pictures are made by `batchenc decode`, `batchenc export` and "
                       "`scripts/picture_of_ply.py`.", [Check("pictures", "pictures of the dolphin", "a table on samba", OPEN)],
                       ["figure-8.23.csv"], [shown])
    return Item("figure-8.23", "Figure 8.23: reconstructions by PDCT", lambda work: work.run(["samba"], ["pdct-thesis"]), report)


ALL_BETTER = {other: BETTER for other in STATE_OF_ART}
PREDICTIVE = ("baseline-dynapack", "baseline-angle")
PLAIN = {other: BETTER for other in ("baseline-static", "baseline-lpc", "baseline-pca-lpc", "baseline-pca")}
SIMILAR = {"baseline-cpca": CLOSE, "baseline-wavelet": CLOSE}
RLPCAS, OURS = ("rlpca-thesis", "orlpca-thesis"), (*OUR_MODES, "rtpca")
BY_CLUSTERS = [(coder, f"clusters={count}", f"{name_of(coder)}, {count} clusters")
               for coder in ("rlpca-thesis", "orlpca-thesis", "pdct-thesis") for count in (10, 20)]
CLAIMS_RLPCA_COW = {"baseline-static": BETTER, "baseline-lpc": BETTER, "baseline-pca": BETTER, "baseline-pca-lpc": BETTER,
                    "baseline-cpca": BETTER, "baseline-wavelet": CLOSE}

ITEMS = [
    rate_item("8.9", "Figure 8.9: SplitCoder against the state of the art", "SplitCoder with its predictor `time`, and with `fitted` "
              "(best mode), on the cow and, for the dolphin, on samba.",
              [(letter, clip, ("splitcoder-thesis", "splitcoder", *STATE_OF_ART)) for letter, clip in (("a", "cowheavy"), ("b", "samba"))],
              [(clip, "splitcoder-thesis", {**PLAIN, **SIMILAR}) for clip in ("cowheavy", "samba")], ("splitcoder-thesis", "splitcoder")),
    gain_item("8.10", "Figure 8.10: SplitCoder's gains on the chicken", "splitcoder-thesis", (*PREDICTIVE, "baseline-cpca"),
              {"baseline-dynapack": 80, "baseline-angle": 22}, {"baseline-angle": 3, "baseline-cpca": 8, "baseline-dynapack": 18}),
    rate_item("8.14", "Figure 8.14: RLPCA by clusters, and against the state of the art", "(a) RLPCA on dance with 10, 20 and 30 "
              "clusters, (b) RLPCA and ORLPCA on the chicken.",
              [("a", "dance", [("rlpca-thesis", f"clusters={n}", f"RLPCA, {n} clusters") for n in CLUSTERS[:3]]),
               ("b", "chicken", (*RLPCAS, *STATE_OF_ART))],
              [("chicken", coder, ALL_BETTER) for coder in RLPCAS], RLPCAS),
    rate_item("8.15", "Figure 8.15: RLPCA and ORLPCA against the state of the art", "The cow and, for the dolphin, samba.",
              [("a", "cowheavy", (*RLPCAS, *STATE_OF_ART)), ("b", "samba", (*RLPCAS, *STATE_OF_ART))],
              [("cowheavy", "rlpca-thesis", CLAIMS_RLPCA_COW), ("samba", "rlpca-thesis", ALL_BETTER)], RLPCAS),
    zeroed_item("8.16", 1, "da, percent", "more", "the more are zeroed, the larger the error"),
    zeroed_item("8.17", 2, "geometry, bits a vertex and frame", "less", "the more are zeroed, the smaller the rate"),
    gain_item("8.20", "Figure 8.20: PDCT's gains on the chicken", "pdct-thesis", (*PREDICTIVE, "baseline-cpca", "baseline-wavelet"),
              {"baseline-angle": 76, "baseline-dynapack": 81, "baseline-wavelet": 95}, {"baseline-angle": 30, "baseline-cpca": 27}),
    rate_item("8.21", "Figure 8.21: PDCT against the state of the art", "The cow (a), samba for the dolphin (b), and the chicken (c).",
              [(letter, clip, ("pdct-thesis", "pdct", "rlpca-thesis", *STATE_OF_ART, *PREDICTIVE))
               for letter, clip in (("a", "cowheavy"), ("b", "samba"), ("c", "chicken"))],
              [("cowheavy", "pdct-thesis", {**PLAIN, **SIMILAR, "rlpca-thesis": CLOSE}),
               ("samba", "pdct-thesis", {**ALL_BETTER, **{o: BETTER for o in PREDICTIVE}, "rlpca-thesis": CLOSE}),
               ("chicken", "pdct-thesis", {**ALL_BETTER, **{o: BETTER for o in PREDICTIVE}}),
               ("chicken", "rlpca-thesis", {"pdct-thesis": BETTER})], ("pdct-thesis", "pdct")),
    clusters_item(),
    pictures_item(),
    rate_item("8.24", "Figure 8.24: our coders by the number of clusters", "Samba for the snake.",
              [("", "samba", [*BY_CLUSTERS, "splitcoder-thesis"])],
              [("samba", "rlpca-thesis", {"pdct-thesis": CLOSE, "splitcoder-thesis": BETTER})], ()),
    rate_item("8.25", "Figure 8.25: our coders against each other", "Samba for the dolphin (a), and dance (b); RTPCA, beyond the thesis, beside "
              "them.", [("a", "samba", OURS), ("b", "dance", OURS)],
              [(clip, coder, {"pdct-thesis": BETTER, "splitcoder-thesis": BETTER}) for clip in ("samba", "dance") for coder in RLPCAS], RLPCAS),
    rate_item("8.26", "Figure 8.26: our coders against each other", "The cow (a) and the chicken (b).",
              [("a", "cowheavy", OURS), ("b", "chicken", OURS)],
              [(clip, coder, {"pdct-thesis": BETTER, "splitcoder-thesis": BETTER}) for clip in ("cowheavy", "chicken") for coder in RLPCAS],
              RLPCAS),
]
