"""The commands `import` and `export`: meshes of other formats into clips and back, read by simple readers of this file."""

import random
import shutil
import signal
import struct
import subprocess
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


TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}


def read_ply(path):
    """Places and triangles of a .ply file, one value after another."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = [line.split() for line in head.decode().splitlines()]
    order = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": None}[lines[1][1]]
    words, at = body.split() if order is None else None, 0

    def take(kind):
        nonlocal at
        if words is not None:
            at += 1
            return float(words[at - 1]) if kind in ("float", "double") else int(words[at - 1])
        value, = struct.unpack_from(order + TYPES[kind], body, at)
        at += struct.calcsize(order + TYPES[kind])
        return value

    elements = []
    for line in lines:
        if line[0] == "element":
            elements.append((line[1], int(line[2]), []))
        elif line[0] == "property":
            elements[-1][2].append(line[1:])
    found = {}
    for name, count, properties in elements:
        found[name] = [{p[-1]: [take(p[2]) for _ in range(take(p[1]))] if p[0] == "list" else take(p[0])
                        for p in properties} for _ in range(count)]
    assert at == len(body if words is None else words)
    faces = [face["vertex_indices"] for face in found["face"]]
    return (np.array([[v[axis] for axis in "xyz"] for v in found["vertex"]], np.float64).astype(np.float32),
            np.array([[face[0], face[k - 1], face[k]] for face in faces for k in range(2, len(face))], np.int32))


def read_any(path):
    return read_ply(path) if path.suffix == ".ply" else read_text_mesh(path)


def write_ply(path, places, faces, order):
    """Binary in the order wanted, with doubles, normals, an element that no mesh has, and flags at the faces."""
    name = {"<": "little", ">": "big"}[order]
    data = (f"ply\nformat binary_{name}_endian 1.0\nobj_info a test\nelement material 2\n"
            "property list ushort double shades\nproperty char kind\n"
            f"element vertex {len(places)}\nproperty double x\nproperty short nx\nproperty double y\n"
            f"property double z\nelement face {len(faces)}\nproperty uchar flags\n"
            "property list uint ushort vertex_index\nproperty float area\nend_header\n").encode()
    data += struct.pack(order + "HdddbHb", 3, 1, 2, 3, -1, 0, 5)
    for place in places:
        data += struct.pack(order + "dhdd", float(place[0]), -7, float(place[1]), float(place[2]))
    for face in faces:
        data += struct.pack(f"{order}BI{len(face)}Hf", 9, len(face), *map(int, face), 0.5)
    path.write_bytes(data)


class ImportExport(ProgramTest):
    def setUp(self):
        super().setUp()
        self.positions, self.triangles = sheet(frames=12)
        self.write_clip("clip.h5", self.positions, self.triangles, fps=24.0)

    def test_there_and_back(self):
        for extension, more in (("obj", []), ("off", []), ("ply", []), ("ply", ["--ascii"]), ("obj", ["--ascii"])):
            with self.subTest(extension, more=more):
                shutil.rmtree(self.folder / extension, ignore_errors=True)
                done = self.run_program("export", "clip.h5", "-o", f"out/f_{{frame}}.{extension}", expect=1)
                self.assertIn("out", done.stderr)
                (self.folder / extension).mkdir()
                self.run_program("export", "clip.h5", "-o", f"{extension}/f_{{frame}}.{extension}", *more)
                files = [f"{extension}/f_{k:04}.{extension}" for k in range(12)]
                self.assertEqual(self.files(extension), [file.split("/")[1] for file in files])
                places, triangles = read_any(self.folder / files[5])
                np.testing.assert_array_equal(places, self.positions[5])
                np.testing.assert_array_equal(triangles, self.triangles)
                if extension == "ply":
                    is_text = b"format ascii" in (self.folder / files[5]).read_bytes()
                    self.assertEqual(is_text, bool(more))
                self.run_program("import", *files, "-o", f"{extension}.h5", "--fps", 24, "--overwrite")
                positions, triangles = self.read_clip(f"{extension}.h5")
                np.testing.assert_array_equal(positions, self.positions)
                np.testing.assert_array_equal(triangles, self.triangles)
                with h5py.File(self.folder / f"{extension}.h5", "r") as file:
                    self.assertEqual(file.attrs["fps"], 24.0)

    def test_every_float_comes_back(self):
        """Any bits that are a finite number, and among them one that goes wrong when read as double first."""
        chance = random.Random(5)
        bits = np.array([chance.getrandbits(32) for _ in range(30000)], np.uint32)
        values = bits.view(np.float32)
        values = values[np.isfinite(values)]
        values = values[:values.size // 3 * 3]
        values[0] = np.uint32(0x15AE43FD).view(np.float32)  # 7.038531e-26
        positions = values.reshape(1, -1, 3)
        self.write_clip("wild.h5", positions)
        for name, more in (("w.obj", []), ("w.off", []), ("w.ply", []), ("t.ply", ["--ascii"])):
            self.run_program("export", "wild.h5", "-o", name, *more)
            self.run_program("import", name, "-o", "back.h5", "--overwrite")
            back, triangles = self.read_clip("back.h5")
            np.testing.assert_array_equal(back.view(np.uint32), positions.view(np.uint32), name)
            self.assertIsNone(triangles)

    def test_binary_ply_of_others(self):
        faces = [[0, 1, 14], [1, 15, 14], [2, 3, 17, 16], [5, 6]]
        for order in "<>":
            places = self.positions[3].astype(np.float64) + 1e-9
            write_ply(self.folder / "other.ply", places, faces, order)
            done = self.run_program("import", "other.ply", "-o", "other.h5", "--overwrite")
            self.assertIn("1 faces of more than three", done.stderr)
            positions, triangles = self.read_clip("other.h5")
            np.testing.assert_array_equal(positions[0], places.astype(np.float32))
            self.assertEqual(triangles.tolist(), [[0, 1, 14], [1, 15, 14], [2, 3, 17], [2, 17, 16]])

    def test_sequence_keeps_the_order_given(self):
        self.run_program("export", "clip.h5", "-o", "f_{frame}.ply", "--frames", "3:6")
        self.assertEqual([name for name in self.files(".") if name.endswith(".ply")],
                         ["f_0003.ply", "f_0004.ply", "f_0005.ply"])
        self.run_program("import", "f_0005.ply", "f_0003.ply", "-o", "back.h5", "--name", "waves")
        np.testing.assert_array_equal(self.read_clip("back.h5")[0], self.positions[[5, 3]])
        with h5py.File(self.folder / "back.h5", "r") as file:
            self.assertIn(file.attrs["name"], (b"waves", "waves"))

    def test_signals_stop_cleanly(self):
        positions, triangles = sheet(frames=600, side=60)
        self.write_clip("long.h5", positions, triangles)
        (self.folder / "m").mkdir()
        self.run_program("export", "long.h5", "-o", "m/{frame}.obj", "--frames", "0:1")
        for arguments in (["import", *["m/0000.obj"] * 2000, "-o", "x/back.h5"],
                          ["export", "long.h5", "-o", "x/f{frame}.obj"]):
            (self.folder / "x").mkdir(exist_ok=True)
            with self.subTest(arguments[0]), subprocess.Popen(
                    self.command(*arguments), cwd=self.folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
                    text=True) as program:
                program.stderr.readline()  # its first progress
                program.send_signal(signal.SIGINT)
                self.assertEqual(program.wait(60), 130, program.stderr.read())
                left = self.files("x")
                self.assertFalse([name for name in left if not name.endswith(".obj")], left)
                self.assertLess(len(left), 600)
                for name in left:  # each is whole
                    self.assertEqual(len(read_text_mesh(self.folder / "x" / name)[1]), len(triangles))

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
        for name, words in (("more", "4 vertices, not 3"), ("other", "(0, 2, 1) for triangle 0, not (0, 1, 2)"),
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
