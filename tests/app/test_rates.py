"""Rates and errors against the committed table: rates.csv, whose change a reviewer reads.

A row that gets worse by more than 0.5 %, or better by more than 2 % without the table being updated, fails. Rows name a clip
(a real one, passed over where there are no data, or "synth KIND VERTICES FRAMES"), and the job's codec and segmentation in YAML. Run
with --update to measure all rows anew; a row that is wanted is added to the table with its figures left empty, and --update fills
them. OpenBLAS is told to use its Haswell kernels, because singular vectors of near-equal singular values are turned differently by
others, which moves the range of a basis, and with it some rows by more than that.
"""

import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

import h5py

import rate_table
from harness import DATA, ProgramTest

TABLE = Path(__file__).parent / "rates.csv"
ABSENT = "is not in this version"


class Comparison(unittest.TestCase):
    """The guard itself: planted rows must fail."""

    ROW = {"clip": "planted", "codec": "{method: rlpca}", "segmentation": "", "bytes": "10000", "bpvf": "2", "da": "0.5",
           "kg": "0.25", "max_error": "0.01"}
    SAME = {"bits_total": 80000, "bpvf": 2.0, "da": 0.5, "kg": 0.25, "max_error": 0.01}

    def judge(self, **changed):
        return rate_table.judge(self.ROW, {**self.SAME, **changed})

    def test_what_is_within_the_tolerance_passes(self):
        self.assertEqual(self.judge(), [])
        self.assertEqual(self.judge(bits_total=80000 * 1.0049, bpvf=2 * 1.0049, da=0.5 * 0.981), [])

    def test_worse_fails(self):
        for name, value in self.SAME.items():
            with self.subTest(name):
                wrong = self.judge(**{name: value * 1.0051})
                self.assertEqual(len(wrong), 1)
                self.assertIn("worse", wrong[0])
                self.assertIn("bytes" if name == "bits_total" else name, wrong[0])

    def test_much_better_fails_and_says_to_update(self):
        for name, value in self.SAME.items():
            with self.subTest(name):
                wrong = self.judge(**{name: value * 0.979})
                self.assertEqual(len(wrong), 1)
                self.assertIn("--update", wrong[0])

    def test_no_number_and_no_figures_fail(self):
        self.assertEqual(len(self.judge(da=float("nan"))), 1)
        self.assertEqual(len(rate_table.judge({**self.ROW, "da": "0"}, self.SAME)), 1)
        self.assertIn("--update", rate_table.judge({**self.ROW, "bytes": ""}, self.SAME)[0])

    def test_a_measured_row_is_its_own_figures(self):
        self.assertEqual(rate_table.judge({**self.ROW, **rate_table.figures(self.SAME)}, self.SAME), [])


class Rates(ProgramTest):
    def clip(self, name):
        """Path of a clip, made if it is a synthetic one; None where there are no data."""
        kind = re.fullmatch(r"synth (\w+) (\d+) (\d+)", name)
        if not kind:
            return DATA / f"{name}.h5" if DATA.is_dir() else None
        path = self.folder / f"{name.replace(' ', '-')}.h5"
        if not path.exists():
            self.run_program("synth", kind[1], "-o", path, "--vertices", kind[2], "--frames", kind[3])
        return path

    def measure(self, rows):
        """Metrics of every row; None of those without a clip, or with a coder that this program refuses to have."""
        jobs = {}
        for number, row in enumerate(rows):
            clip = self.clip(row["clip"])
            if not clip:
                continue
            jobs[number] = f"row{number}.yaml"
            segmentation = f"segmentation: {row['segmentation']}\n" if row["segmentation"] else ""
            (self.folder / jobs[number]).write_text(
                f"batchenc: 1\nname: row{number}\ninput: {{file: '{clip}'}}\noutput: row{number}.h5\nanalysis: false\n"
                f"{segmentation}codec: {row['codec']}\n", encoding="utf-8")
        run = subprocess.run(self.command(*jobs.values(), "--progress", "none"), cwd=self.folder, capture_output=True, text=True,
                             timeout=580, env={**os.environ, "OPENBLAS_CORETYPE": "Haswell"})
        metrics = [None] * len(rows)
        for number in jobs:
            result = self.folder / f"row{number}.h5"
            if result.exists():
                with h5py.File(result) as file:
                    metrics[number] = dict(file["metrics"].attrs)
                continue
            said = re.findall(rf"job row{number}: .*", run.stderr)
            self.assertIn(ABSENT, said[-1] if said else run.stderr, f"{rows[number]}")
        return metrics

    def test_committed_table(self):
        if " avx2 " not in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
            self.skipTest("the table was made with kernels that this CPU cannot run")
        rows = rate_table.read_table(TABLE)
        passed_over = set()
        for row, metrics in zip(rows, self.measure(rows)):
            name = f"{row['clip']} {row['codec']} {row['segmentation']}"
            with self.subTest(name):
                if metrics:
                    self.assertEqual(rate_table.judge(row, metrics), [], name)
                else:
                    self.assertFalse(row["bytes"] and row["clip"].startswith("synth "), f"{name}: the coder is gone")
                    passed_over.add(row["clip"] if not self.clip(row["clip"]) else rate_table.method(row))
        if passed_over:
            print("passed over: " + ", ".join(sorted(passed_over)), file=sys.stderr)

    def test_every_coder_has_rows_on_every_synthetic_clip(self):
        text = self.run_program("--help-job").stdout
        words = re.search(r"codec\.method\s(.*?);", text, re.DOTALL).group(1)
        rows = rate_table.read_table(TABLE)
        clips = {row["clip"] for row in rows if row["clip"].startswith("synth ")}
        self.assertGreaterEqual(len(clips), 3)
        have = {(row["clip"], rate_table.method(row)) for row in rows}
        for method in re.findall(r"[\w-]+", words):
            for clip in clips:
                self.assertIn((clip, method), have)

    def update(self):
        rows = rate_table.read_table(TABLE)
        for row, metrics in zip(rows, self.measure(rows)):
            if metrics:
                row.update(rate_table.figures(metrics))
            else:
                print(f"left as it is: {row['clip']} {row['codec']}", file=sys.stderr)
        rate_table.write_table(TABLE, rows)


if __name__ == "__main__":
    if "--update" in sys.argv:
        suite = unittest.TestSuite([Rates("update")])
        sys.exit(not unittest.TextTestRunner().run(suite).wasSuccessful())
    unittest.main()
