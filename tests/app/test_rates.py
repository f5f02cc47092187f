"""Rates and errors on real clips against the committed table: rates.csv, whose change a reviewer reads.

A row that gets worse by more than 0.5 %, or better by more than 2 % without the table being updated, fails. OpenBLAS is told to use
its Haswell kernels, because singular vectors of near-equal singular values are turned differently by others, which moves the range
of a basis, and with it some rows by more than that. Run with --update to write the table anew.
"""

import csv
import os
import sys
import unittest
from pathlib import Path

from harness import DATA, ProgramTest

TABLE = Path(__file__).parent / "rates.csv"
FIGURES = ("bpvf_geometry", "da", "kg")


def read_table():
    with open(TABLE, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class Rates(ProgramTest):
    def measure(self, row):
        self.write_job("job", DATA / f"{row['clip']}.h5", output="out.h5",
                       clusters=row["clusters"], components=row["components"], more="analysis: false\n")
        self.run_program("job.yaml", "--overwrite", env={**os.environ, "OPENBLAS_CORETYPE": "Haswell"})
        return self.info("out.h5")["metrics"]

    def test_committed_table(self):
        if not DATA.is_dir():
            self.skipTest(f"no clips in {DATA}")
        if " avx2 " not in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
            self.skipTest("the table was made with kernels that this CPU cannot run")
        for row in read_table():
            metrics = self.measure(row)
            for figure in FIGURES:
                change = metrics[figure] / float(row[figure]) - 1
                with self.subTest(f"{row['clip']} N {row['clusters']} L {row['components']} {figure}"):
                    self.assertLessEqual(change, 0.005, "worse than the table")
                    self.assertGreaterEqual(change, -0.02, "better than the table: update it")

    def update(self):
        rows = read_table()
        for row in rows:
            metrics = self.measure(row)
            row.update({figure: f"{metrics[figure]:.5f}" for figure in FIGURES})
        with open(TABLE, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    if "--update" in sys.argv:
        suite = unittest.TestSuite([Rates("update")])
        sys.exit(not unittest.TextTestRunner().run(suite).wasSuccessful())
    unittest.main()
