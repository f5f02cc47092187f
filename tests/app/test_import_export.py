"""The commands `import` and `export`: meshes of other formats into clips and back, read by simple readers of this file."""

import unittest

import h5py
import numpy as np

from harness import DATA, ProgramTest, sheet


def read_text_mesh(path):
    """Places and triangles of an .obj or .off file."""
    lines = [line.split("#")[0].split() for line in path.read_text().splitlines()]
    lines = [words for words in lines if words]
    if path.suffix == ".obj":
        places = [words[1:4] for words in lines if words[0] == "v"]
        faces = [[int(word.split("/")[0]) - 1 for word in words[1:]] for words in lines if words[0] == "f"]
    else:
        count, face_count = map(int, lines[1][:2])
        places = [words[:3] for words in lines[2:2 + count]]
        faces = [list(map(int, words[1:1 + int(words[0])])) for words in lines[2 + count:2 + count + face_count]]
    triangles = [[face[0], face[k - 1], face[k]] for face in faces for k in range(2, len(face))]
    return np.array(places, np.float64).astype(np.float32), np.array(triangles, np.int32)


class ImportExport(ProgramTest):
    def setUp(self):
        super().setUp()
        self.positions, self.triangles = sheet(frames=12)
        self.write_clip("clip.h5", self.positions, self.triangles, fps=24.0)

    def test_there_and_back(self):
        for extension in ("obj", "off", "ply"):
            with self.subTest(extension):
                done = self.run_program("export", "clip.h5", "-o", f"out/f_{{frame}}.{extension}", expect=1)
                self.assertIn("out", done.stderr)
                (self.folder / extension).mkdir()
                self.run_program("export", "clip.h5", "-o", f"{extension}/f_{{frame}}.{extension}")
                files = [f"{extension}/f_{k:04}.{extension}" for k in range(12)]
                self.assertEqual(self.files(extension), [file.split("/")[1] for file in files])
                if extension != "ply":
                    places, triangles = read_text_mesh(self.folder / files[5])
                    np.testing.assert_array_equal(places, self.positions[5])
                    np.testing.assert_array_equal(triangles, self.triangles)
                self.run_program("import", *files, "-o", f"{extension}.h5", "--fps", 24)
                positions, triangles = self.read_clip(f"{extension}.h5")
                np.testing.assert_array_equal(positions, self.positions)
                np.testing.assert_array_equal(triangles, self.triangles)
                with h5py.File(self.folder / f"{extension}.h5", "r") as file:
                    self.assertEqual(file.attrs["fps"], 24.0)

    def test_frames(self):
        self.run_program("export", "clip.h5", "-o", "one.obj", "--frames", "7:8")
        np.testing.assert_array_equal(read_text_mesh(self.folder / "one.obj")[0], self.positions[7])
        done = self.run_program("export", "clip.h5", "-o", "many.obj", "--frames", "7:9", expect=1)
        self.assertIn("{frame}", done.stderr)
        self.run_program("export", "clip.h5", "-o", "x.obj", "--frames", "11:13", expect=1)

    def test_polygons_are_noted(self):
        (self.folder / "quad.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nf 1 2 3 4\nf 1 2\n")
        done = self.run_program("import", "quad.obj", "-o", "quad.h5")
        self.assertIn("1 faces of more than three", done.stderr)
        self.assertIn("1 faces of fewer than three", done.stderr)
        positions, triangles = self.read_clip("quad.h5")
        self.assertEqual(positions.shape, (1, 5, 3))
        self.assertEqual(triangles.tolist(), [[0, 1, 2], [0, 2, 3]])

    def test_meshes_that_differ_are_named(self):
        start = "v 0 0 0\nv 1 0 0\nv 1 1 0\n"
        texts = {"a": start + "f 1 2 3\n", "more": start + "v 2 2 2\nf 1 2 3\n", "other": start + "f 1 3 2\n",
                 "fewer": start, "broken": start + "f 1 2 9\n"}
        for name, text in texts.items():
            (self.folder / f"{name}.obj").write_text(text)
        for name, words in (("more", "4 vertices, not 3"), ("other", "another triangle 0"),
                            ("fewer", "0 triangles, not 1"), ("broken", "broken.obj:4")):
            done = self.run_program("import", "a.obj", f"{name}.obj", "-o", "x.h5", expect=1)
            self.assertIn(name, done.stderr)
            self.assertIn(words, done.stderr)
        self.run_program("import", "a.obj", "-o", "clip.h5", expect=1)
        self.run_program("import", "a.obj", "-o", "a.obj", "--overwrite", expect=1)
        self.run_program("import", "-o", "x.h5", expect=2)
        self.run_program("import", "a.stl", "-o", "x.h5", expect=1)
        self.assertFalse((self.folder / "x.h5").exists())
        self.assertFalse([name for name in self.files(".") if name.endswith(".tmp")])

    def test_real_meshes(self):
        folder = DATA.parent / "static"
        if not folder.is_dir():
            self.skipTest(f"no meshes in {folder}")
        for path in sorted(folder.iterdir()):
            with self.subTest(path.name):
                self.run_program("import", path, "-o", "mesh.h5", "--overwrite")
                positions, triangles = self.read_clip("mesh.h5")
                expected, expected_triangles = read_text_mesh(path)
                np.testing.assert_array_equal(positions[0], expected)
                np.testing.assert_array_equal(triangles, expected_triangles)


if __name__ == "__main__":
    unittest.main()
