"""The static coder as a user runs it: bound, metrics and triangles, on sheets, points and the first frames of real clips."""

import unittest

import h5py
import numpy as np

from harness import DATA, ProgramTest, sheet


class Static(ProgramTest):
    def encode(self, source, output="out.h5", expect=0, **codec):
        keys = ", ".join(f"{key}: {value}" for key, value in {"method": "static", **codec}.items())
        (self.folder / "job.yaml").write_text(f"batchenc: 1\ninput: {{file: {source}}}\noutput: {output}\ncodec: {{{keys}}}\n")
        return self.run_program("job.yaml", "--overwrite", expect=expect)

    def check_bound(self, positions, triangles, bits):
        decoded = self.check_result("out.h5", positions, triangles)
        e_max = np.ptp(positions.reshape(-1, 3), axis=0).max()
        error = np.linalg.norm(decoded.astype(np.float64) - positions, axis=2).max()
        self.assertLessEqual(error, e_max * 2.0**-bits)
        return error

    def test_round_trip_at_every_predictor(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        sizes = {}
        for predictor in ("auto", "parallelogram", "multiway", "local-parallelogram", "local-multiway", "fitted",
                          "touma-gotsman", "hope", "hopi", "hops", "weighted"):
            self.encode("clip.h5", bits=10, predictor=predictor)
            self.check_bound(positions, triangles, 10)
            sizes[predictor] = self.info("out.h5")["metrics"]["bits_residuals"]
        self.assertEqual(min(sizes, key=sizes.get), "auto")
        self.assertEqual(self.info("out.h5")["clips"][0]["parameters"], {"method": "static", "bits": 10})

    def stream(self, result="out.h5"):
        with h5py.File(self.folder / result, "r") as file:
            return file["clips/000000/bitstream"][()].tobytes()

    def test_every_tangential_prediction(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        for predictor in ("touma-gotsman", "hope", "hopi", "hops"):
            streams = set()
            for tangential in ("parallelogram", "multiway", "fitted", "weighted"):
                with self.subTest(f"{predictor} {tangential}"):
                    self.encode("clip.h5", bits=10, predictor=predictor, tangential=tangential)
                    self.check_bound(positions, triangles, 10)
                    streams.add(self.stream())
            self.assertEqual(len(streams), 4, predictor)

    def test_what_a_surface_is_fitted_to(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        self.encode("clip.h5", bits=10, predictor="hope", fit_vertices=0, fit_exponent=-1, fit_cosine=-1)
        own = self.stream()
        self.encode("clip.h5", bits=10, predictor="hope", fit_vertices=18, fit_exponent=1.3, fit_cosine=0.5)
        self.assertEqual(self.stream(), own)
        fits = ({}, {"fit_vertices": 5}, {"fit_vertices": 64}, {"fit_exponent": 0}, {"fit_exponent": 8}, {"fit_cosine": 0},
                {"fit_cosine": 0.999})
        for predictor in ("hope", "hopi", "hops"):
            streams = set()
            for fit in fits:
                with self.subTest(f"{predictor} {fit}"):
                    self.encode("clip.h5", bits=10, predictor=predictor, **fit)
                    self.check_bound(positions, triangles, 10)
                    streams.add(self.stream())
            self.assertEqual(len(streams), len(fits), predictor)

    def test_refuses_fits_outside_their_range(self):
        self.write_clip("clip.h5", *sheet())
        for key, value in (("fit_vertices", 65), ("fit_vertices", 2), ("fit_vertices", -1), ("fit_exponent", 8.5),
                           ("fit_exponent", -0.5), ("fit_cosine", 1.5), ("fit_cosine", -0.1), ("fit_cosine", ".nan"),
                           ("tangential", "straight")):
            with self.subTest(f"{key} {value}"):
                done = self.encode("clip.h5", expect=2, predictor="hope", **{key: value})
                self.assertIn(key, done.stderr)
                self.assertFalse((self.folder / "out.h5").exists())

    def test_more_bits_less_error(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        errors = []
        for bits in (4, 8, 12, 16, 20, 24):
            self.encode("clip.h5", bits=bits)
            errors.append(self.check_bound(positions, triangles, bits))
        self.assertEqual(errors, sorted(errors, reverse=True))

    def test_has_no_clusters(self):
        self.write_clip("clip.h5", *sheet())
        self.encode("clip.h5")
        with h5py.File(self.folder / "out.h5", "r") as file:
            self.assertEqual(set(file["analysis/000000"]), {"vertex_rmse"})
        self.run_program("verify", "out.h5", "--source", "clip.h5")

    def test_points_and_single_frames(self):
        positions, triangles = sheet()
        self.write_clip("points.h5", positions)
        self.encode("points.h5")
        self.check_bound(positions, None, 12)
        self.write_clip("frame.h5", positions[:1], triangles)
        self.encode("frame.h5")
        self.check_bound(positions[:1], triangles, 12)

    def test_frames_are_decoded_alone(self):
        self.write_clip("clip.h5", *sheet())
        self.encode("clip.h5")
        self.run_program("decode", "out.h5", "-o", "whole.h5")
        self.run_program("decode", "out.h5", "-o", "part.h5", "--frames", "7:9")
        np.testing.assert_array_equal(self.read_clip("part.h5")[0], self.read_clip("whole.h5")[0][7:9])

    def test_first_frames_of_real_clips(self):
        if not DATA.is_dir():
            self.skipTest(f"no clips in {DATA}")
        for path in sorted(DATA.glob("*.h5")):
            with h5py.File(path, "r") as file:
                positions, triangles = file["positions"][:1], file["triangles"][()]
            self.write_clip("frame.h5", positions, triangles)
            for bits in (6, 8, 10, 12, 14, 16):
                with self.subTest(f"{path.stem} {bits}"):
                    self.encode("frame.h5", bits=bits)
                    self.check_bound(positions, triangles, bits)


if __name__ == "__main__":
    unittest.main()
