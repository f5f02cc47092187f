"""What all parts share: where clips, programs and tables are, and what a part says of itself on the page."""
import statistics
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import curves
from drawing import Axis, Curve, draw_curves
from rd_curves import CODERS
from rd_runs import RunTable, read_rows, write_rows, write_text
from reproduction.modes import MODE_COLUMNS, NAMES, THESIS_MODES, is_dashed, name_of

BEATEN, MET, NOT, OPEN, PARTLY = "beaten", "met", "not", "open", "partly"
NOT_MEASURED = "not measured"


@dataclass
class Check:
    """One printed value or statement beside ours. verdict: BEATEN, MET, NOT, or OPEN where it cannot be judged."""
    what: str
    thesis: str
    ours: str
    verdict: str


@dataclass
class Section:
    shows: str
    checks: list = field(default_factory=list)
    files: list = field(default_factory=list)  # in the output folder
    notes: list = field(default_factory=list)  # paragraphs of Markdown that the figures decide

    def verdict(self):
        """beaten: all is met and more than half of it beaten; partly: some is met and some is not; not: nothing is met."""
        found = [check.verdict for check in self.checks if check.verdict != OPEN]
        if not found:
            return OPEN
        if NOT in found:
            return NOT if set(found) == {NOT} else PARTLY
        return BEATEN if 2 * found.count(BEATEN) > len(found) else MET


@dataclass
class Item:
    """A table or figure. measure(work) makes what is missing and returns the number of failures; report(work) reads the tables alone,
    draws, and returns a Section, or None where nothing is measured yet."""
    name: str
    title: str
    measure: callable
    report: callable


def at_most(ours, printed, slack=0.02):
    """Verdict on a value of which less is better."""
    if ours is None:
        return OPEN
    return BEATEN if ours < printed * (1 - slack) else MET if ours <= printed * (1 + slack) else NOT


def at_least(ours, stated, slack=2.0):
    """Verdict on a gain in percent of which more is better."""
    if ours is None:
        return OPEN
    return BEATEN if ours > stated + slack else MET if ours >= stated - slack else NOT


def holds(truth):
    return OPEN if truth is None else MET if truth else NOT


def number(value, digits=3):
    return "" if value is None else f"{float(value):.{digits}g}"


def percent(value):
    return "" if value is None else f"{value:+.0f} %"


def gain_words(gain):
    """What curves.gains gives, in words."""
    return f"{gain[2]:.0f} to {gain[0]:.0f} %, mean {gain[1]:.0f} %"


def table(head, rows):
    line = lambda cells: "| " + " | ".join(str(cell) for cell in cells) + " |"
    return "\n".join([line(head), line(["---"] * len(head)), *map(line, rows)])


class Work:
    def __init__(self, clips, output, program="", bench=None, meshes=None, threads=(), again=False):
        self.clips = {path.stem: path for path in sorted(Path(clips).glob("*.h5"))} if clips else {}
        self.output, self.program, self.bench, self.meshes = Path(output), program, bench, meshes
        self.threads, self.again = list(threads), again
        self.best = RunTable(self.output / "rd_curves.csv", CODERS, program, threads, again)
        self.modes = RunTable(self.output / "thesis_modes.csv", THESIS_MODES, program, threads, again, MODE_COLUMNS)
        self.processes = 0
        self.refreshed = set()

    @property
    def runs(self):
        return self.best.runs + self.modes.runs + self.processes

    def run(self, clips, coders):
        """Measures what is missing of coders on clips, those there are; returns the number of failures."""
        failures = 0
        for clip in clips:
            if clip not in self.clips:
                print(f"left out: no clip {clip}", file=sys.stderr)
                continue
            for coder in coders:
                failures += (self.modes if coder in THESIS_MODES else self.best).run(self.clips[clip], coder)
        return failures

    def rows(self, clip, coder, having=""):
        """Rows of a coder on a clip whose setting has these words, with spaces."""
        found = (self.modes if coder in THESIS_MODES else self.best).of(clip, coder)
        words = set(having.split())
        return [row for row in found if words <= set(row["setting"].split())]

    def curve(self, clip, coder, having=""):
        """da and the geometry's bits a vertex and frame, which the literature counts."""
        return curves.envelope(self.rows(clip, coder, having), "da", "bpvf_geometry")

    def read(self, name):
        return read_rows(self.output / name)

    def write(self, name, rows):
        write_rows(self.output / name, list(rows[0]), rows)

    def draw(self, name, text):
        write_text(self.output / name, text)

    def bench_table(self, name, key, wanted, arguments):
        """A CSV whose rows come from a program of bench, one call for each key that is missing. wanted: keys; arguments(key): the
        command without its folder. Returns the number of failures."""
        have = [] if self.again and name not in self.refreshed else self.read(name)
        self.refreshed.add(name)
        failures = 0
        for index, value in enumerate(wanted, 1):
            if any(row[key] == value for row in have):
                continue
            print(f"{name}: {value}, {index} of {len(wanted)}", file=sys.stderr, flush=True)
            program, *rest = arguments(value)
            try:
                run = subprocess.run([str(Path(self.bench) / program), *map(str, rest)], stdout=subprocess.PIPE, text=True, check=True)
            except (OSError, subprocess.CalledProcessError) as error:
                print(f"failed: {name} {value}: {error}", file=sys.stderr)
                failures += 1
                continue
            self.processes += 1
            columns, *lines = run.stdout.splitlines()
            named = {"clip": value} if key == "clip" else {}  # the file's name, not what it calls itself
            have += [{**dict(zip(columns.split(","), line.split(","))), **named} for line in lines]
            have.sort(key=lambda row: wanted.index(row[key]) if row[key] in wanted else len(wanted))  # stable
            self.write(name, have)
        return failures

    def draw_rates(self, figure, clip, which, title=""):
        """Curves of rate and error on a clip. which: coders, or (coder, words of its setting, name). Returns names of the SVG and its
        CSV, none where nothing is measured."""
        drawn, points = [], []
        for index, one in enumerate(which):
            coder, having, name = one if isinstance(one, tuple) else (one, "", name_of(one))
            curve = self.curve(clip, coder, having)
            if not curve:
                continue
            colour = NAMES[coder][1] if not having else ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#555555")[index % 6]
            drawn.append(Curve(name, [(rate, error) for error, rate, _ in curve], colour, dash="5 3" if is_dashed(coder) else "",
                               words=[row["setting"] for _, _, row in curve]))
            points += [{"clip": clip, "curve": name, "setting": row["setting"], "bpvf_geometry": row["bpvf_geometry"],
                        "da": row["da"]} for _, _, row in curve]
        if not drawn:
            return []
        self.draw(f"{figure}.svg", draw_curves(f"{figure.replace('-', ' ')}: {title or clip}", "towards the lower left is better",
                                               Axis("geometry, bits a vertex and frame", True), Axis("da, percent", True), drawn))
        self.write(f"{figure}.csv", points)
        return [f"{figure}.svg", f"{figure}.csv"]

    def missing(self, clip, a, b):
        """Why two coders cannot be compared on a clip."""
        found = [self.curve(clip, coder) for coder in (a, b)]
        if not all(found):
            return NOT_MEASURED
        spans = [f"{number(curve[0][0])} to {number(curve[-1][0])}" for curve in found]
        return f"no common range: da {spans[0]} against {spans[1]}"

    def difference(self, clip, a, b, having=""):
        """Mean rate of a over b at equal da, percent."""
        return curves.difference(self.curve(clip, a, having), self.curve(clip, b, having))


def mean(values):
    return statistics.fmean(values) if values else None
