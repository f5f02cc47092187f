"""scripts/reproduce.py on small clips: it goes on where it was stopped, and its verdicts follow the figures."""

import csv
import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

from harness import BINARY, ProgramTest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))

import curves  # noqa: E402
import rd_runs  # noqa: E402
import rtpca_place  # noqa: E402
from reproduction import page, rate_figures, statements, work  # noqa: E402


def curve(*points):
    """A curve of (error, rate)."""
    return curves.envelope([{"da": error, "bpvf": rate} for error, rate in points], "da", "bpvf")


class Curves(unittest.TestCase):
    def test_an_envelope_leaves_out_what_is_beaten(self):
        self.assertEqual([point[:2] for point in curve((1, 4), (2, 5), (4, 1), (0, 9))], [(1, 4), (4, 1)])

    def test_interpolation_is_straight_in_logarithms(self):
        line = curve((1, 8), (4, 2))
        self.assertAlmostEqual(curves.rate_at(line, 2), 4)
        self.assertAlmostEqual(curves.error_at(line, 4), 2)
        self.assertAlmostEqual(curves.rate_at(line, 1), 8)
        self.assertIsNone(curves.rate_at(line, 0.9))
        self.assertIsNone(curves.error_at(line, 9))

    def test_gains_of_a_curve_at_half_the_rate(self):
        whole, half = curve((1, 8), (4, 2)), curve((2, 2), (8, 0.5))
        most, middle, least, start, end = curves.gains(half, whole)
        for value in (most, middle, least):
            self.assertAlmostEqual(value, 50)
        self.assertEqual((start, end), (2, 4))
        self.assertAlmostEqual(curves.difference(whole, half), 100)
        self.assertIsNone(curves.gains(whole, curve((5, 1), (6, 0.5))))

    def test_at_equal_rate_errors_are_compared(self):
        whole, half = curve((1, 8), (4, 2)), curve((0.5, 8), (2, 2))
        self.assertAlmostEqual(curves.gains(curves.swapped(half), curves.swapped(whole))[1], 50)


class Verdicts(unittest.TestCase):
    def test_printed_values(self):
        self.assertEqual([work.at_most(value, 10) for value in (9, 10.1, 10.3, None)],
                         [work.BEATEN, work.MET, work.NOT, work.OPEN])
        self.assertEqual([work.at_least(value, 40) for value in (43, 38.5, 37, None)],
                         [work.BEATEN, work.MET, work.NOT, work.OPEN])

    def test_an_item(self):
        verdict = lambda *found: work.Section("", [work.Check("", "", "", one) for one in found]).verdict()
        self.assertEqual(verdict(work.BEATEN, work.MET, work.BEATEN), work.BEATEN)
        self.assertEqual(verdict(work.BEATEN, work.MET), work.MET)
        self.assertEqual(verdict(work.BEATEN, work.NOT, work.OPEN), work.PARTLY)
        self.assertEqual(verdict(work.NOT, work.OPEN), work.NOT)
        self.assertEqual(verdict(work.OPEN), work.OPEN)

    def test_statements_turn_when_figures_do(self):
        self.assertEqual(statements.judge_gain([(45, 20, 5, 1, 2)], 42), (work.BEATEN, "true"))
        self.assertEqual(statements.judge_gain([(30, 20, 5, 1, 2)], 42)[0], work.NOT)
        self.assertIn("partly", statements.judge_gain([(30, 20, 5, 1, 2)], 42)[1])
        self.assertEqual(statements.judge_gain([(10, -20, -50, 1, 2)], 42)[1], "false")
        self.assertIn("false on the mean", statements.judge_gain([(45, -20, -50, 1, 2)], 42)[1])
        self.assertEqual(statements.judge_gain([(45, 20, 5, 1, 2)], 42, is_mean=True)[0], work.NOT)
        self.assertEqual(statements.truth({"a": True, "b": True})[0], work.MET)
        self.assertEqual(statements.truth({"a": True, "b": False}), (work.NOT, "partly: not b"))
        self.assertEqual(statements.truth({"a": False})[1], "false everywhere")

    def test_claims_turn_when_a_rate_gets_worse(self):
        class Planted:
            def __init__(self, percent):
                self.difference = lambda *_: percent
                self.missing = lambda *_: "not measured"

        found = [rate_figures.claims(Planted(percent), "chicken", "pdct-thesis", {"baseline-lpc": claim})[0].verdict
                 for percent, claim in ((-5, "better"), (5, "better"), (5, "similar"), (15, "similar"), (None, "better"))]
        self.assertEqual(found, [work.MET, work.NOT, work.MET, work.NOT, work.OPEN])


class Runs(ProgramTest):
    CODERS = {"static": [rd_runs.each("codec.bits", 6, 8), rd_runs.each("codec.predictor", "weighted")]}

    def setUp(self):
        super().setUp()
        (self.folder / "clips").mkdir()
        self.run_program("synth", "walker", "-o", "clips/chicken.h5", "--vertices", "300", "--frames", "8")

    def command_line(self, *more):
        return [sys.executable, SCRIPTS / "reproduce.py", "clips", "--binary", BINARY, "--output", "docs/out", "--threads", "1", *more]

    def reproduce(self, *more):
        done = subprocess.run(self.command_line(*more), cwd=self.folder, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        return int(re.search(r"^(\d+) runs, 0 failed", done.stderr, re.MULTILINE)[1])

    def rows(self, name="thesis_modes.csv"):
        with open(self.folder / "docs/out" / name, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def test_it_makes_what_is_asked_for_and_then_nothing_again(self):
        first = self.reproduce("--only", "figure-8.12,figure-8.16")
        rows = self.rows()
        self.assertEqual(first, 3 + len(rows))
        self.assertEqual(len(rows), 80)
        self.assertEqual({row["curve"] for row in self.rows("figure-8.12.csv")}, {"N 20, L 20", "N 20, L 10", "N 10, L 10"})
        text = (self.folder / "docs/REPRODUCTION.md").read_text(encoding="utf-8")
        self.assertIn("](out/figure-8.16.svg)", text)
        self.assertIn("Not measured yet.", text)
        before = {path: path.read_bytes() for path in (self.folder / "docs").glob("**/*.*")}
        self.assertEqual(self.reproduce("--only", "figure-8.12,figure-8.16,figure-8.17"), 0)
        for path, content in before.items():
            if "8.17" not in path.name and path.suffix != ".md":
                self.assertEqual(path.read_bytes(), content, path)
        self.assertEqual(self.reproduce("--only", "figure-8.12", "--again"), 3)

    def test_it_goes_on_where_it_was_stopped(self):
        for stop in (signal.SIGTERM, signal.SIGKILL):
            run = subprocess.Popen(self.command_line("--only", "figure-8.16"), cwd=self.folder, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
            table, start = self.folder / "docs/out/thesis_modes.csv", time.time()
            while run.poll() is None and not (table.exists() and table.stat().st_mtime > start):
                time.sleep(0.02)
            run.send_signal(stop)
            self.assertIn(run.wait(timeout=60), (128 + stop, -stop))
        have = len(self.rows())
        self.assertTrue(0 < have < 80, have)
        self.assertEqual(self.reproduce("--only", "figure-8.16"), 80 - have)
        self.assertTrue(all(all(row.values()) for row in self.rows()))

    def test_a_table_is_whole_or_as_it_was(self):
        path = self.folder / "table.csv"
        rd_runs.write_rows(path, ["a"], [{"a": "1"}])
        with self.assertRaises(ZeroDivisionError):
            rd_runs.write_rows(path, ["a"], ({"a": str(1 // part)} for part in (1, 0)))
        self.assertEqual(rd_runs.read_rows(path), [{"a": "1"}])

    def test_a_coder_that_the_program_has_not_is_left_out(self):
        program = self.folder / "refuses"
        program.write_text("#!/bin/sh\necho \"error job curves: coder 'x' is not in this version [unsupported]\" >&2\nexit 1\n")
        program.chmod(0o755)
        table = rd_runs.RunTable(self.folder / "runs.csv", self.CODERS, program)
        self.assertEqual(table.run(self.folder / "clips/chicken.h5", "static"), 0)
        self.assertEqual(table.absent, {"static"})
        program.write_text("#!/bin/sh\necho broken >&2\nexit 1\n")
        table = rd_runs.RunTable(self.folder / "runs.csv", self.CODERS, program)
        self.assertEqual(table.run(self.folder / "clips/chicken.h5", "static"), 2)

    def test_rows_are_kept_and_those_of_other_settings_go(self):
        path = self.folder / "runs.csv"
        table = rd_runs.RunTable(path, self.CODERS, BINARY)
        self.assertEqual(table.run(self.folder / "clips/chicken.h5", "static"), 0)
        self.assertEqual(table.runs, 2)
        fewer = rd_runs.RunTable(path, {"static": [rd_runs.each("codec.bits", 8, 10), self.CODERS["static"][1]]}, BINARY)
        self.assertEqual(fewer.run(self.folder / "clips/chicken.h5", "static"), 0)
        self.assertEqual(fewer.runs, 1)
        self.assertEqual([row["setting"] for row in rd_runs.read_rows(path)],
                         ["bits=8 predictor=weighted", "bits=10 predictor=weighted"])

    def test_a_second_run_waits_for_nobody(self):
        out = self.folder / "docs/out"
        out.mkdir(parents=True)
        descriptor = os.open(out, os.O_RDONLY)
        self.addCleanup(os.close, descriptor)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        done = subprocess.run(self.command_line("--only", "figure-8.12,figure-8.16"), cwd=self.folder, capture_output=True, text=True,
                              timeout=60)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("another run is writing tables", done.stderr)

    def test_mistakes_in_the_command_line(self):
        for more in (["--only", "figure-9.9"], ["--binary", "nowhere"]):
            done = subprocess.run(self.command_line(*more), cwd=self.folder, capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)


class Page(ProgramTest):
    def test_the_committed_page_is_what_the_committed_tables_say(self):
        docs = SCRIPTS.parent / "docs"
        shutil.copytree(docs / "reproduction", self.folder / "docs/reproduction")
        subprocess.run([sys.executable, SCRIPTS / "reproduce.py", "--no-runs", "--output", self.folder / "docs/reproduction"], check=True,
                       stderr=subprocess.DEVNULL, timeout=120)
        made = (self.folder / "docs/REPRODUCTION.md").read_text(encoding="utf-8")
        self.assertEqual(made, (docs / "REPRODUCTION.md").read_text(encoding="utf-8"), "run scripts/reproduce.py --no-runs")

    def test_the_readme_has_the_table_that_the_committed_figures_give(self):
        done = subprocess.run([sys.executable, SCRIPTS / "rtpca_place.py", "--check"], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        text = "before\n| coder | a |\n| --- | --- |\n| rtpca | 1 |\nafter"
        self.assertEqual(rtpca_place.in_readme(text, ["| coder | b |"]), "before\n| coder | b |\nafter")
        self.assertNotEqual(rtpca_place.in_readme(text, ["| coder | b |"]), text)

    def test_headings_and_links_agree(self):
        self.assertEqual(page.anchor("Table 8.6: RLPCA against CPCA, rates and times"), "table-86-rlpca-against-cpca-rates-and-times")


if __name__ == "__main__":
    unittest.main()
