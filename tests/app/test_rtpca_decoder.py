"""RTPCA's clips, decoded by the program and by the second decoder that is written from docs/FORMAT.md alone. Every
stream has to end exactly for the second one, so that all coded integers are the same, and FORMAT.md gives the order of
all operations, so that every bit of a position is."""

import unittest
from unittest import mock

import h5py
import numpy as np

import independent_rtpca
from harness import ProgramTest
from independent_decoder import decode_result, shuffle_triangles, soup
from independent_fields import FieldCoder
from independent_tracks import TrackCoder


def drop_triangles(path):
    with h5py.File(path, "r+") as file:
        del file["triangles"]


def lay_soup(path):
    drop_triangles(path)
    with h5py.File(path, "r+") as file:
        file["triangles"] = soup()


def collapse(path):
    """The same place for all vertices, in all frames."""
    with h5py.File(path, "r+") as file:
        file["positions"][...] = 1


def freeze(path):
    """The first frame in all frames: only there a correction can change."""
    with h5py.File(path, "r+") as file:
        file["positions"][...] = file["positions"][0]


def jumps(count=40, size=65, frames=60):
    """Two bodies of points of which one moves off; in both, groups of points jump in a frame each."""
    points = np.random.default_rng(5).uniform(size=(2 * count * size, 3))
    positions = np.tile(points, (frames, 1, 1))
    positions[:, len(points) // 2:, 0] += 3 + 0.05 * np.arange(frames)[:, None]
    for k in range(2 * count):
        positions[k % frames, k * size:(k + 1) * size, k // frames % 3] += 0.05 + 0.00125 * k
    return positions.astype(np.float32)


CASES = [
    # name, synth kind, vertices, frames, a change to the file, clusters, step, further keys of the job, bound
    ("walker", "walker", 200, 40, None, 8, 0.0005, "", None),
    ("flag", "flag", 150, 30, None, 8, 0.002, "", 0.001),
    ("jelly", "jelly", 200, 20, None, 8, 0.0005, "order: free\n", 0.001),
    ("long", "walker", 64, 300, None, 6, 0.001, "", None),
    ("long-bound", "flag", 64, 131, None, 3, 0.002, "", 0.001),
    ("points", "walker", 150, 12, drop_triangles, 8, 0.002, "", 0.001),
    ("odd", "flag", 150, 12, shuffle_triangles, 8, 0.002, "", 0.001),
    ("soup", "jelly", 500, 4, lay_soup, 8, 0.002, "", 0.001),
    ("one", "jelly", 200, 1, None, 8, 0.0005, "", 0.001),
    ("two", "walker", 100, 2, None, 1, 0.0005, "", None),
    ("crowded", "jelly", 100, 6, None, 60, 0.001, "", None),
    ("still", "flag", 64, 5, collapse, 3, 0.001, "", 0.001),
    ("frozen", "walker", 100, 5, freeze, 3, 0.01, "", 0.001),
    ("clips", "walker", 100, 40, None, 4, 0.001, "clips: {length: 13}\n", 0.0005),
    *((f"step-{step}", "jelly", 100, 16, None, 4, step, "", None) for step in (0.3, 0.01, 1e-7)),
    ("tight", "jelly", 100, 6, None, 4, 0.01, "", 2e-6),
]


class RtpcaDecoder(ProgramTest):
    def watch(self, owner, function, look):
        """What look(result, arguments …) gives whenever a part of the second decoder is called."""
        seen, original = set(), getattr(owner, function)

        def watched(*arguments):
            result = original(*arguments)
            seen.add(look(result, *arguments))
            return result

        patch = mock.patch.object(owner, function, watched)
        patch.start()
        self.addCleanup(patch.stop)
        return seen

    def encode(self, name, clusters, step, keys, bound):
        target = f", target: {{max_error_relative: {bound}}}" if bound else ""
        (self.folder / f"{name}.yaml").write_text(
            f"batchenc: 1\ninput: {{file: {name}.h5}}\noutput: out/{name}.h5\n{keys}"
            f"segmentation: {{method: rigid, clusters: {clusters}}}\n"
            f"codec: {{method: rtpca, step: {step}{target}}}\n")
        self.run_program(f"{name}.yaml")

    def compare(self, name, components=None):
        """Positions of both decoders."""
        decoded = f"decoded-{name}-{components}.h5"
        further = [] if components is None else ["--components", components]
        self.run_program("decode", f"out/{name}.h5", "-o", decoded, *further)
        with h5py.File(self.folder / decoded, "r") as file:
            expected = file["positions"][()]
            expected_triangles = file["triangles"][()] if "triangles" in file else np.zeros((0, 3), np.int32)
        positions, triangles = decode_result(self.folder / "out" / f"{name}.h5", components)
        np.testing.assert_array_equal(triangles, expected_triangles)
        np.testing.assert_array_equal(positions, expected)
        return positions

    def test_same_positions(self):
        forms = self.watch(TrackCoder, "code", lambda result, *_: result[0])
        predictors = self.watch(FieldCoder, "code", lambda result, *_: result[0])
        parents = self.watch(independent_rtpca, "compose", lambda result, parents, own: max(parents) >= 0)
        changes = self.watch(independent_rtpca.Offsets, "decode_frame", lambda result, *_: result > 0)
        for name, kind, vertices, frames, change, clusters, step, keys, bound in CASES:
            with self.subTest(name):
                self.run_program("synth", kind, "-o", f"{name}.h5", "--vertices", vertices, "--frames", frames)
                if change:
                    change(self.folder / f"{name}.h5")
                self.encode(name, clusters, step, keys, bound)
                positions = self.compare(name)
                if bound and "free" not in keys:
                    with h5py.File(self.folder / f"{name}.h5", "r") as file:
                        source = file["positions"][()].astype(np.float64)
                    diagonal = np.linalg.norm(np.ptp(source.reshape(-1, 3), axis=0))
                    error = np.linalg.norm(source - positions, axis=2).max()
                    self.assertLessEqual(error, bound * diagonal * (1 + 1e-12))
        self.assertEqual(forms, set(range(8)))
        self.assertEqual(predictors, set(range(5)))
        self.assertEqual(parents, {False, True})
        self.assertEqual(changes, {False, True})

    def test_first_components(self):
        self.run_program("synth", "walker", "-o", "walker.h5", "--vertices", 150, "--frames", 30)
        self.encode("walker", 4, 0.0005, "", 0.001)
        for components in (1, 7, 4096):
            with self.subTest(components=components):
                self.compare("walker", components)

    def test_several_streams(self):
        streams = self.watch(independent_rtpca, "deal_streams", lambda result, *_: len(result))
        self.write_clip("jumps.h5", jumps())
        self.encode("jumps", 2, 0.002, "", None)
        self.compare("jumps")
        self.assertEqual(streams, {2})


if __name__ == "__main__":
    unittest.main()
