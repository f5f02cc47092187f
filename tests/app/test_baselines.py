"""Every baseline from job to decoded clip, measured without the program's code; and what `info` says of coders."""

import re
import unittest

import h5py
import numpy as np

from harness import ProgramTest, sheet

SETTINGS = {  # those that have a choice
    "baseline-lpc": ("lpc_order: 1", "lpc_order: 2"),
    "baseline-dynapack": ("predictor: lorenzo", "predictor: replica", "predictor: auto"),
    "baseline-pca-lpc": ("lpc_order: 1", "lpc_order: 2, components: 3"),
}


class Baselines(ProgramTest):
    def baselines(self):
        words = re.search(r"codec\.method\s(.*?);", self.run_program("--help-job").stdout, re.DOTALL).group(1)
        found = [word for word in re.findall(r"[\w-]+", words) if word.startswith("baseline-")]
        self.assertEqual(len(found), 11)
        return found

    def write(self, method, setting="", more=""):
        codec = f"method: {method}" + (f", {setting}" if setting else "")
        (self.folder / "b.yaml").write_text("batchenc: 1\ninput: {file: clip.h5}\noutput: out.h5\n"
                                            f"segmentation: {{clusters: 4}}\ncodec: {{{codec}}}\n{more}")

    def check(self, positions, triangles, message):
        decoded = self.check_result("out.h5", positions, triangles)
        error = np.abs(decoded - positions).max()
        self.assertLess(error, 0.02 * np.ptp(positions.reshape(-1, 3), axis=0).max(), message)
        self.run_program("verify", "out.h5", "--source", "clip.h5")

    def test_meshes(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        for method in self.baselines():
            for setting in SETTINGS.get(method, ("",)):
                with self.subTest(method, setting=setting):
                    self.write(method, setting, "clips: {length: 9}\n")
                    self.run_program("b.yaml", "--overwrite")
                    self.check(positions, triangles, method)
                    with h5py.File(self.folder / "out.h5") as result:
                        self.assertEqual(result.attrs["method"].decode(), method)

    def test_points(self):
        positions, _ = sheet(frames=12)
        self.write_clip("clip.h5", positions)
        for method in self.baselines():
            with self.subTest(method):
                self.write(method)
                self.run_program("b.yaml", "--overwrite")
                self.check(positions, None, method)

    def test_threads_write_the_same(self):
        self.write_clip("clip.h5", *sheet())
        for method in self.baselines():
            with self.subTest(method):
                self.write(method)
                streams = []
                for threads in (1, 3):
                    self.run_program("b.yaml", "--overwrite", "--threads", threads)
                    with h5py.File(self.folder / "out.h5") as result:
                        streams.append(result["clips/000000/bitstream"][()].tobytes())
                self.assertEqual(streams[0], streams[1])

    def test_no_targets(self):
        self.write_clip("clip.h5", *sheet())
        self.write("baseline-wavelet", "target: {kg: 1}")
        self.assertIn("takes no targets", self.run_program("b.yaml", expect=2).stderr)

    def test_info_says_what_a_coder_has(self):
        self.write_clip("clip.h5", *sheet())
        for setting, expected in (
                ("method: splitcoder, predictor: lorenzo, bits: 9", {"method", "predictor", "normal", "max_error"}),
                ("method: pdct", {"method", "bits", "intra_bits", "frame_bits", "transform"}),
                ("method: pdct, transform: temporal",
                 {"method", "bits", "intra_bits", "frame_bits", "transform", "block"}),
                ("method: rtpca", {"method", "step", "max_error"}),
                ("method: rlpca",
                 {"method", "space", "components", "basis_bits", "coefficient_bits", "frame_bits"})):
            with self.subTest(setting):
                method, _, rest = setting.removeprefix("method: ").partition(", ")
                self.write(method, rest)
                self.run_program("b.yaml", "--overwrite")
                self.assertEqual(set(self.info("out.h5")["clips"][0]["parameters"]), expected)


if __name__ == "__main__":
    unittest.main()
