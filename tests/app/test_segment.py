"""The command `segment`: labels, deviations and picture of a clip, read and measured without the program's code."""

import unittest

import h5py
import numpy as np

from harness import DATA, ProgramTest, sheet

METHODS = ("region-growing", "clustering", "adaptive", "rigid")


def local_steps(positions, triangle):
    """theta (4.1) of every vertex in the LCF of a triangle, in double precision."""
    p = positions.astype(np.float64)
    a, b, c = (p[:, v] for v in triangle)
    x = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    z = np.cross(b - a, c - a)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    q = np.einsum("fij,fvj->fvi", axes, p - ((a + b) / 2)[:, None])
    return (np.diff(q, axis=0) ** 2).sum(axis=(0, 2))


def read_ply(path):
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in header.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, [("place", "<f4", 3), ("color", "u1", 3)], counts[0])
    faces = np.frombuffer(body, [("count", "u1"), ("corners", "<i4", 3)], counts[1], vertices.nbytes)
    assert vertices.nbytes + faces.nbytes == len(body) and (faces["count"] == 3).all()
    return vertices, faces["corners"]


class Segment(ProgramTest):
    def check_labels(self, path, positions, clusters):
        """The file's content against the definitions; gives the labels."""
        with h5py.File(self.folder / path, "r") as file:
            self.assertEqual(file.attrs["format"], b"batchenc-labels")
            labels, theta = file["labels"][()], file["vertex_deviation"][()]
            seeds, deviations = file["seed_triangles"][()], file["cluster_deviation"][()]
            average = file.attrs["average_deviation"]
        frames, vertices, _ = positions.shape
        self.assertEqual((labels.shape, labels.dtype, theta.dtype), ((vertices,), "<i4", "<f4"))
        self.assertEqual((seeds.shape, deviations.shape), ((clusters, 3), (clusters,)))
        self.assertEqual(set(labels), set(range(clusters)))
        corner = np.zeros(vertices, bool)
        corner[seeds.ravel()] = True
        for i in range(clusters):
            mine = (labels == i) & ~corner
            expected = local_steps(positions, seeds[i])
            np.testing.assert_allclose(theta[mine], expected[mine], rtol=2e-3, atol=1e-9)
            mean = expected[mine].sum() / frames / max(mine.sum(), 1)
            self.assertAlmostEqual(deviations[i], mean, delta=2e-3 * mean + 1e-12)
        self.assertAlmostEqual(average, deviations.mean(), delta=1e-9 * average)
        return labels

    def test_every_method(self):
        positions, triangles = sheet(frames=25, side=20)
        self.write_clip("clip.h5", positions, triangles)
        for method in METHODS:
            with self.subTest(method):
                done = self.run_program("segment", "clip.h5", "-o", f"{method}.h5", "--method", method,
                                        "--clusters", 6, "--ply", f"{method}.ply")
                self.assertIn("6 clusters of 400 vertices over 25 frames", done.stdout)
                labels = self.check_labels(f"{method}.h5", positions, 6)
                vertices, faces = read_ply(self.folder / f"{method}.ply")
                np.testing.assert_array_equal(vertices["place"], positions[0])
                np.testing.assert_array_equal(faces, triangles)
                colors = {(label, tuple(color)) for label, color in zip(labels, vertices["color"].tolist())}
                self.assertEqual(len(colors), 6, "one colour a cluster")
                self.assertEqual(len({color for _, color in colors}), 6, "another one for each")

    def test_a_job_finds_the_same_clusters(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        for method in METHODS:
            self.run_program("segment", "clip.h5", "-o", "labels.h5", "--method", method, "--clusters", 5, "--overwrite",
                             "--frames", "3:15")
            labels = self.check_labels("labels.h5", positions[3:15], 5)
            (self.folder / "job.yaml").write_text(
                f"batchenc: 1\ninput: {{file: clip.h5, frames: [3, 15]}}\noutput: out.h5\n"
                f"segmentation: {{method: {method}, clusters: 5}}\n")
            self.run_program("job.yaml", "--overwrite")
            with h5py.File(self.folder / "out.h5", "r") as result, h5py.File(self.folder / "labels.h5", "r") as file:
                np.testing.assert_array_equal(result["analysis/000000/labels"][()], labels)
                np.testing.assert_array_equal(result["analysis/000000/cluster_deviation"][()],
                                              file["cluster_deviation"][()])

    def test_same_labels_for_any_threads(self):
        self.run_program("synth", "walker", "-o", "walker.h5", "--vertices", 3000, "--frames", 40)
        for method in METHODS:
            found = []
            for threads in (1, 2, 5):
                self.run_program("segment", "walker.h5", "-o", "labels.h5", "--method", method, "--threads", threads,
                                 "--overwrite")
                with h5py.File(self.folder / "labels.h5", "r") as file:
                    found.append({name: file[name][()].tobytes() for name in file})
            self.assertEqual(found[0], found[1], method)
            self.assertEqual(found[0], found[2], method)

    def test_automatic_and_threshold(self):
        positions, triangles = sheet()
        self.write_clip("clip.h5", positions, triangles)
        counts = {}
        for threshold in (1, 0.01, 0.003):
            self.run_program("segment", "clip.h5", "-o", "labels.h5", "--method", "adaptive", "--clusters", 60, "--overwrite",
                             "--threshold", threshold)
            with h5py.File(self.folder / "labels.h5", "r") as file:
                counts[threshold] = len(file["seed_triangles"])
                e_max = np.ptp(positions.reshape(-1, 3), axis=0).max()
                # Seeds move once more after the growth has ended, which only lowers the deviation.
                self.assertLessEqual(np.sqrt(file.attrs["average_deviation"]), threshold * e_max)
        self.assertEqual(counts[1], 1)
        self.assertLess(counts[0.01], counts[0.003])
        self.run_program("segment", "clip.h5", "-o", "labels.h5", "--clusters", 0, "--overwrite")

    def test_points(self):
        positions, _ = sheet()
        self.write_clip("points.h5", positions)
        for method in METHODS:
            self.run_program("segment", "points.h5", "-o", "labels.h5", "--method", method, "--clusters", 4, "--overwrite",
                             "--ply", "points.ply")
            self.assertEqual(len(read_ply(self.folder / "points.ply")[1]), 0)

    def test_mistakes(self):
        self.write_clip("clip.h5", *sheet())
        (self.folder / "there.h5").write_bytes(b"mine")
        for arguments in (["--method", "growing"], ["--clusters", "-1"], ["--clusters", "65536"], ["--threshold", "2"],
                          ["--threshold", "x"], ["--frames", "5"]):
            with self.subTest(arguments):
                self.run_program("segment", "clip.h5", "-o", "x.h5", *arguments, expect=2)
        for arguments in (["clip.h5", "-o", "there.h5"], ["clip.h5", "-o", "x.h5", "--ply", "there.h5"],
                          ["clip.h5", "-o", "clip.h5", "--overwrite"], ["clip.h5", "-o", "x.h5", "--ply", "x.h5"],
                          ["clip.h5", "-o", "x.h5", "--frames", "0:99"], ["there.h5", "-o", "x.h5"],
                          ["none.h5", "-o", "x.h5"], ["clip.h5", "-o", "nowhere/x.h5"]):
            with self.subTest(arguments):
                self.assertEqual(self.run_program("segment", *arguments, expect=1).stdout, "")
        self.assertEqual(self.files("."), ["clip.h5", "there.h5"])
        self.assertEqual((self.folder / "there.h5").read_bytes(), b"mine")

    def test_memory_is_bounded(self):
        self.write_clip("clip.h5", *sheet(frames=300, side=20))
        done = self.run_program("segment", "clip.h5", "-o", "x.h5", "--memory", "1M", expect=1)
        self.assertIn("--frames", done.stderr)

    def test_classic_clips(self):
        if not DATA.is_dir():
            self.skipTest(f"no clips in {DATA}")
        for name in ("chicken", "cowheavy", "dance"):
            found = {}
            for method in METHODS:
                self.run_program("segment", DATA / f"{name}.h5", "-o", "labels.h5", "--method", method, "--overwrite")
                with h5py.File(self.folder / "labels.h5", "r") as file:
                    found[method] = file.attrs["average_deviation"]
            with self.subTest(name):
                self.assertLessEqual(found["rigid"], found["adaptive"])
                self.assertLessEqual(found["adaptive"], found["clustering"])
                self.assertLessEqual(found["clustering"], found["region-growing"])


if __name__ == "__main__":
    unittest.main()
