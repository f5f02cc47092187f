"""Section 8.8: its statements one by one, with figures, at equal da or at equal rate over all clips there are."""
import curves
from rd_curves import CODERS
from reproduction.modes import name_of
from reproduction.rate_figures import OUR_MODES
from reproduction.work import MET, NOT, NOT_MEASURED, OPEN, Check, Item, Section, at_least, gain_words, mean, number, percent, table

CLIPS = ("chicken", "cowheavy", "dance", "samba")
BEST = {"rlpca-thesis": "rlpca", "orlpca-thesis": "orlpca", "pdct-thesis": "pdct", "splitcoder-thesis": "splitcoder"}
BASELINES = tuple(name for name in CODERS if name.startswith("baseline-"))
ORLPCA, RLPCA, PDCT, SPLIT = "orlpca-thesis", "rlpca-thesis", "pdct-thesis", "splitcoder-thesis"
# What is stated, coder, against, clips, percent saved: at most, or on the mean where it says about.
GAINS = [
    ("ORLPCA saves up to 42 % over RLPCA", ORLPCA, RLPCA, CLIPS, 42), ("RLPCA saves up to 32 % over PDCT", RLPCA, PDCT, CLIPS, 32),
    ("RLPCA saves up to 69 % over SplitCoder", RLPCA, SPLIT, CLIPS, 69), ("PDCT saves up to 73 % over SplitCoder", PDCT, SPLIT, CLIPS, 73),
    ("RLPCA saves about 36 % over DCT on the chicken", RLPCA, PDCT, ("chicken",), 36),
    ("RLPCA saves about 48 % over SplitCoder on the chicken", RLPCA, SPLIT, ("chicken",), 48),
    ("On the snake (here samba) RLPCA saves up to 73 % over SplitCoder", RLPCA, SPLIT, ("samba",), 73)]
MODES = [("thesis' modes", None, ""), ("thesis' modes, 20 clusters", None, "clusters=20"), ("our best modes", BEST, "")]


def curve_in(work, clip, coder, mode):
    _, stand_in, having = mode
    coder = stand_in[coder] if stand_in else coder
    return work.curve(clip, coder, "" if "splitcoder" in coder else having)


def judge_gain(found, stated, is_mean=False):
    """Verdict and word on a stated gain, at most or on the mean. found: gains of each clip, as curves.gains gives them."""
    most, middle = max(gain[0] for gain in found), mean([gain[1] for gain in found])
    verdict = at_least(middle if is_mean else most, stated)
    if verdict != NOT:
        return verdict, "true" if middle > 0 else "true where it is most, false on the mean"
    return NOT, "partly: a gain, but less" if middle > 0 else "false"


def gain_checks(work, mode, rows):
    checks = []
    for says, coder, other, clips, stated in GAINS:
        found = {clip: curves.gains(curve_in(work, clip, coder, mode), curve_in(work, clip, other, mode)) for clip in clips}
        found = {clip: gain for clip, gain in found.items() if gain}
        if not found:
            checks.append(Check(f"{says} ({mode[0]})", f"{stated} %", NOT_MEASURED, OPEN))
            continue
        verdict, word = judge_gain(list(found.values()), stated, "about" in says)
        ours = "; ".join(f"{clip} {gain_words(gain)}" for clip, gain in found.items())
        checks.append(Check(f"{says} ({mode[0]})", f"{stated} %", f"{word}: {ours}", verdict))
        rows += [{"statement": says, "mode": mode[0], "clip": clip, "thesis_percent": stated, "most": f"{gain[0]:.1f}",
                  "mean": f"{gain[1]:.1f}", "least": f"{gain[2]:.1f}", "da_from": number(gain[3]), "da_to": number(gain[4]),
                  "verdict": word} for clip, gain in found.items()]
    return checks


def truth(parts):
    """true, false, or partly with what it fails on. parts: {clip or pair: whether it holds}."""
    if not parts:
        return OPEN, NOT_MEASURED
    bad = [name for name, holds_there in parts.items() if not holds_there]
    if not bad:
        return MET, "true"
    return NOT, "false everywhere" if len(bad) == len(parts) else f"partly: not {', '.join(bad)}"


def ranking_checks(work, mode):
    """Who is smaller than whom, on the mean over equal da or equal rate."""
    checks = []
    pairs = {}
    for clip in CLIPS:
        for coder in (RLPCA, ORLPCA):
            for other in (PDCT, SPLIT):
                change = curves.difference(curve_in(work, clip, coder, mode), curve_in(work, clip, other, mode))
                if change is not None:
                    pairs[f"{clip} {name_of(coder)} against {name_of(other)} ({change:+.0f} %)"] = change < 0
    verdict, word = truth(pairs)
    says = "RLPCA and ORLPCA outperform PDCT and SplitCoder, mean rate at equal da"
    checks.append(Check(f"{says} ({mode[0]})", "on all clips", word, verdict))
    for coder, others, says in ((PDCT, (SPLIT,), "PDCT distorts less than SplitCoder at equal rate"),
                                (RLPCA, (PDCT, SPLIT), "RLPCA distorts less than PDCT and SplitCoder at equal rate, always")):
        pairs = {}
        for clip in CLIPS:
            for other in others:
                change = curves.difference(curves.swapped(curve_in(work, clip, coder, mode)),
                                           curves.swapped(curve_in(work, clip, other, mode)))
                if change is not None:
                    pairs[f"{clip} against {name_of(other)} (da {change:+.0f} %)"] = change < 0
        verdict, word = truth(pairs)
        checks.append(Check(f"{says} ({mode[0]})", "on all clips", word, verdict))
    return checks


def ends_checks(work, mode):
    """What is said of low and of high rates."""
    low, high = {}, {}
    for clip in CLIPS:
        found = {coder: curve_in(work, clip, coder, mode) for coder in OUR_MODES}
        span = curves.common_range(*found.values()) if all(found.values()) else None
        if not span:
            continue
        rates = [{coder: curves.rate_at(curve, da) for coder, curve in found.items()} for da in span]
        fine, coarse = rates
        spread = 100 * (max(fine.values()) / min(fine.values()) - 1)
        high[f"{clip} (at da {span[0]:.2g} the largest rate is {spread:.1f} % above the smallest)"] = spread <= 25
        over = 100 * (coarse[SPLIT] / min(coarse.values()) - 1)
        low[f"{clip} (at da {span[1]:.2g} SplitCoder is {over:.0f} % above the smallest)"] = over > 25
    checks = []
    for says, parts in (("At very low rates SplitCoder is not efficient: more than 25 % above the smallest", low),
                        ("At high rates all methods come close to each other: within 25 %", high)):
        verdict, word = truth(parts)
        listed = f"{word}: {'; '.join(parts)}" if word == "true" or word.startswith("false") else word
        checks.append(Check(f"{says} ({mode[0]})", "on all clips", listed if parts else word, verdict))
    return checks


def time_checks(work):
    """Table 8.7's column of decoding times."""
    parts = {}
    for clip in CLIPS:
        seconds = {coder: mean([float(row["decode_time_s"]) for row in work.rows(clip, coder)]) for coder in (RLPCA, PDCT, SPLIT)}
        if all(seconds.values()):
            parts[f"{clip} ({', '.join(f'{name_of(c)} {s:.3g} s' for c, s in seconds.items())})"] = min(seconds, key=seconds.get) == RLPCA
    verdict, word = truth(parts)
    return [Check("RLPCA's decoding is the fastest", "on all clips", f"{word}: {'; '.join(parts)}" if word == "true" else word, verdict)]


def baseline_table(work):
    """Markdown: mean rate at equal da of our coders over each baseline, clip by clip."""
    coders = (*OUR_MODES, *BEST.values(), "rtpca")
    there = [b for b in BASELINES if any(work.curve(clip, b) for clip in CLIPS)]
    if not there:
        return ["Against the baselines: not measured yet."], []
    rows, shown = [], []
    for clip in CLIPS:
        for coder in coders:
            change = {other: work.difference(clip, coder, other) for other in there}
            if any(value is not None for value in change.values()):
                shown.append([clip, name_of(coder), *(percent(change[other]) for other in there)])
                rows.append({"clip": clip, "coder": coder, **{other: number(change[other]) for other in there}})
    return ["Each coder against the baselines, mean rate at equal da, negative: ours is smaller; empty: no common range.",
            table(["clip", "coder", *map(name_of, there)], shown)], rows


def measure(work):
    return work.run(CLIPS, [*OUR_MODES, *BEST.values(), "rtpca", *BASELINES])


def report(work):
    if not any(work.curve(clip, RLPCA) for clip in CLIPS):
        return None
    rows, checks = [], []
    for mode in MODES:
        checks += gain_checks(work, mode, rows)
    for mode in (MODES[0], MODES[2]):
        checks += ranking_checks(work, mode) + ends_checks(work, mode)
    checks += time_checks(work)
    checks.append(Check("Reconstructions by RLPCA are nearly identical to the original to the eye, SplitCoder's and PDCT's are blocky at low rates",
                        "pictures", "not judged by figures; the errors at equal rate above stand for it", OPEN))
    notes, baseline_rows = baseline_table(work)
    files = []
    if rows:
        work.write("section-8.8.csv", rows)
        files.append("section-8.8.csv")
    if baseline_rows:
        work.write("section-8.8-baselines.csv", baseline_rows)
        files.append("section-8.8-baselines.csv")
    return Section("Every statement of the comparison, on chicken, cow, dance, and samba for dolphin and snake: in the thesis' own modes, with 20 "
                   "clusters alone, and in ours that are best (rigid clusters, free choice of bits, PDCT over time with allocation, "
                   "SplitCoder's `fitted`).", checks, files + ["thesis_modes.csv", "rd_curves.csv"], notes)


ITEMS = [Item("section-8.8", "Section 8.8: the methods against each other", measure, report)]
