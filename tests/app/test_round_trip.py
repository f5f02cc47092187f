"""Clips of every kind that the contract names: encoded, decoded, verified, and measured by numpy."""

import unittest

import h5py
import numpy as np
from harness import DATA, ProgramTest, sheet


class RoundTrip(ProgramTest):
    def encode_and_check(self, positions, triangles=None, **job):
        self.write_clip("clip.h5", positions, triangles, fps=25.0, name="clip")
        self.write_job("a", "clip.h5", **job)
        self.run_program("a.yaml", "--overwrite")
        decoded = self.check_result("out/a.h5", positions.astype(np.float32), triangles)
        self.run_program("verify", "out/a.h5", "--source", "clip.h5")
        return decoded

    def test_synthetic_clips(self):
        for kind in ("walker", "flag", "jelly"):
            with self.subTest(kind):
                self.run_program("synth", kind, "-o", f"{kind}.h5", "--vertices", 600, "--frames", 24)
                positions, triangles = self.read_clip(f"{kind}.h5")
                self.assertEqual(positions.shape[0], 24)
                self.assertLessEqual(abs(positions.shape[1] - 600), 30)
                self.write_job(kind, f"{kind}.h5", more="clips: {length: 10}\n")
                self.run_program(f"{kind}.yaml")
                self.check_result(f"out/{kind}.h5", positions, triangles)
                self.run_program("verify", f"out/{kind}.h5", "--source", f"{kind}.h5")

    def test_same_seed_same_clip(self):
        for name, seed in (("a", 5), ("b", 5), ("c", 6)):
            self.run_program("synth", "flag", "-o", f"{name}.h5", "--vertices", 200, "--frames", 5, "--seed", seed)
        a, b, c = (self.read_clip(f"{name}.h5")[0] for name in "abc")
        np.testing.assert_array_equal(a, b)
        self.assertFalse(np.array_equal(a, c))

    def test_triangles(self):
        self.encode_and_check(*sheet())

    def test_float64_and_int64(self):
        positions, triangles = sheet()
        self.encode_and_check(positions.astype(np.float64), triangles.astype(np.int64))

    def test_points(self):
        self.encode_and_check(sheet()[0])

    def test_one_frame(self):
        self.encode_and_check(*sheet(frames=1))

    def test_one_triangle(self):
        corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float32)
        moving = np.concatenate([corners, corners + np.float32(0.25), corners * np.float32(2)])
        self.encode_and_check(moving, np.array([[0, 1, 2]], np.int32))

    def test_clip_that_never_moves(self):
        positions, triangles = sheet(frames=1)
        self.encode_and_check(np.repeat(positions, 8, axis=0), triangles)

    def test_chunked_and_compressed_source(self):
        positions, triangles = sheet(frames=30)
        with h5py.File(self.folder / "clip.h5", "w") as file:
            file.create_dataset("positions", data=positions, chunks=(7, 50, 2), compression="gzip", shuffle=True)
            file.create_dataset("triangles", data=triangles, chunks=(100, 3), compression="gzip")
        self.write_job("a", "clip.h5")
        self.run_program("a.yaml")
        self.check_result("out/a.h5", positions, triangles)

    def test_frame_range_of_the_source(self):
        positions, triangles = sheet(frames=30)
        self.write_clip("clip.h5", positions, triangles)
        self.write_job("a", "clip.h5", frames=(4, 21), more="clips: {length: 6}\n")
        self.run_program("a.yaml")
        self.check_result("out/a.h5", positions[4:21], triangles)
        self.run_program("verify", "out/a.h5", "--source", "clip.h5")

    def test_part_of_a_result(self):
        whole = self.encode_and_check(*sheet(frames=30), more="clips: {length: 8}\n")
        for begin, end, text in ((0, 30, ":"), (0, 5, ":5"), (6, 18, "6:18"), (24, 30, "24:"), (15, 16, "15:16")):
            self.run_program("decode", "out/a.h5", "-o", "part.h5", "--overwrite", "--frames", text)
            np.testing.assert_array_equal(self.read_clip("part.h5")[0], whole[begin:end], text)
        self.run_program("decode", "out/a.h5", "-o", "few.h5", "--components", 2)
        few = self.read_clip("few.h5")[0]
        self.run_program("decode", "out/a.h5", "-o", "few-part.h5", "--components", 2, "--frames", "6:18")
        np.testing.assert_array_equal(self.read_clip("few-part.h5")[0], few[6:18])
        self.assertFalse(np.array_equal(few, whole))
        self.run_program("decode", "out/a.h5", "-o", "all.h5", "--components", 4096)
        np.testing.assert_array_equal(self.read_clip("all.h5")[0], whole)

    def test_sweep(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        self.write_job("a", "clip.h5", output='"out/{components}.h5"', more="sweep: {codec.components: [2, 4]}\n")
        rows = self.run_program("a.yaml").stdout.splitlines()
        self.assertEqual(self.files(), ["2.h5", "4.h5"])
        self.assertEqual(len(rows), 3, rows)  # a heading and a row a job
        for name in ("2", "4"):
            self.check_result(f"out/{name}.h5", positions, triangles)

    def test_threads_write_the_same(self):
        self.write_clip("clip.h5", *sheet(frames=40))
        self.write_job("a", "clip.h5", more="clips: {length: 7}\n")
        found = []
        for threads in (1, 2, 4):
            self.run_program("a.yaml", "--overwrite", "--threads", threads)
            with h5py.File(self.folder / "out/a.h5", "r") as file:
                found.append([file["connectivity/bitstream"][()].tobytes()] +
                             [file[f"clips/{name}/bitstream"][()].tobytes() for name in sorted(file["clips"])])
        self.assertEqual(len(found[0]), 7)
        self.assertEqual(found[0], found[1])
        self.assertEqual(found[0], found[2])

    def test_analysis(self):
        positions, triangles = sheet()
        decoded = self.encode_and_check(positions, triangles, more="clips: {length: 9}\n")
        with h5py.File(self.folder / "out/a.h5", "r") as file:
            for clip, first in enumerate((0, 9, 18)):
                group = file[f"analysis/{clip:06}"]
                error = (positions[first:first + 9] - decoded[first:first + 9]).astype(np.float64)
                np.testing.assert_allclose(group["vertex_rmse"][()], np.sqrt((error ** 2).sum(axis=2).mean(axis=0)),
                                           rtol=1e-5)
                self.assertEqual(group["labels"].shape, (196,))
                self.assertLess(group["labels"][()].max(), 4)
        self.write_job("plain", "clip.h5", more="analysis: false\n")
        self.run_program("plain.yaml")
        with h5py.File(self.folder / "out/plain.h5", "r") as file:
            self.assertNotIn("analysis", file)

    def test_targets_of_rtpca(self):
        self.run_program("synth", "walker", "-o", "clip.h5", "--vertices", 600, "--frames", 40)
        positions, triangles = self.read_clip("clip.h5")
        for number, (target, wanted, clips) in enumerate((("kg", 0.2, 0), ("da", 0.2, 15), ("bpvf", 4, 0), ("bpvf", 9, 15),
                                                          ("max_error_relative", 1e-3, 15))):
            with self.subTest(target, clips=clips):
                (self.folder / "t.yaml").write_text(
                    f"batchenc: 1\ninput: {{file: clip.h5}}\noutput: out/t{number}.h5\nclips: {{length: {clips}}}\n"
                    f"codec: {{method: rtpca, target: {{{target}: {wanted}}}}}\n")
                self.run_program("t.yaml")
                self.check_result(f"out/t{number}.h5", positions, triangles)
                reached = self.info(f"out/t{number}.h5")["metrics"][target]
                self.assertLessEqual(reached, wanted)
                self.assertGreaterEqual(reached, 0.9 * wanted if clips == 0 else 0.6 * wanted)

    def test_auto_takes_the_smaller_stream(self):
        self.run_program("synth", "jelly", "-o", "clip.h5", "--vertices", 400, "--frames", 24)
        taken = set()
        for bound in (1e-2, 1e-4):
            bits = {}
            for method in ("rtpca", "splitcoder", "auto"):
                (self.folder / "a.yaml").write_text(
                    f"batchenc: 1\ninput: {{file: clip.h5}}\noutput: out/a.h5\nsegmentation: {{clusters: 4}}\n"
                    f"codec: {{method: {method}, target: {{max_error_relative: {bound}}}}}\n")
                self.run_program("a.yaml", "--overwrite")
                result = self.info("out/a.h5")
                bits[method] = result["metrics"]["bits_total"]
                self.assertLessEqual(result["metrics"]["max_error_relative"], bound)
            self.run_program("verify", "out/a.h5", "--source", "clip.h5")
            self.assertEqual(bits["auto"], min(bits.values()), bits)
            taken.add(result["clips"][0]["parameters"]["method"])
        self.assertEqual(taken, {"rtpca", "splitcoder"})

    def test_real_clips(self):
        if not DATA.is_dir():
            self.skipTest(f"no clips in {DATA}")
        for name in ("eagle", "cloth_x4", "robot_dance"):
            with self.subTest(name):
                positions, triangles = self.read_clip(DATA / f"{name}.h5")
                self.write_job(name, DATA / f"{name}.h5", clusters=20, components=20)
                self.run_program(f"{name}.yaml")
                self.check_result(f"out/{name}.h5", positions, triangles)
                self.run_program("verify", f"out/{name}.h5", "--source", DATA / f"{name}.h5")


if __name__ == "__main__":
    unittest.main()
