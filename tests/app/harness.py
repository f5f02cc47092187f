"""What the end-to-end tests share: running the real program, making clips, measuring without its code."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    print("skipped: needs python3-h5py and python3-numpy")
    sys.exit(77)

BINARY = os.environ["BATCHENC_BINARY"]
DATA = Path(os.environ.get("BATCHENC_DATA_DIR", "/nonexistent")) / "dynamic"


def sheet(frames=20, side=14):
    """A waving sheet: positions [F,V,3], triangles [T,3]."""
    y, x = np.mgrid[0:side, 0:side].astype(np.float64)
    time = np.arange(frames)[:, None, None] * 0.2
    z = 0.5 * np.sin(0.6 * x + time) + 0.3 * np.cos(0.4 * y - 0.7 * time)
    positions = np.stack([x + 0 * z, y + 0.1 * time + 0 * z, z], axis=-1).reshape(frames, side * side, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    triangles = np.concatenate([np.stack([corner, corner + 1, corner + side], 1),
                                np.stack([corner + 1, corner + side + 1, corner + side], 1)])
    return positions.astype(np.float32), triangles.astype(np.int32)


def measure(source, decoded):
    """Distortion by its definitions; None where a quotient is undefined."""
    source, decoded = source.astype(np.float64), decoded.astype(np.float64)
    error = np.linalg.norm(source - decoded)
    distance = np.linalg.norm(source - decoded, axis=2)

    def percent(spread):
        if spread == 0:
            return 0.0 if error == 0 else None
        return 100 * error / spread

    return {"da": percent(np.linalg.norm(source - source.mean(axis=0, keepdims=True))),
            "kg": percent(np.linalg.norm(source - source.mean(axis=1, keepdims=True))),
            "rmse": np.sqrt((distance ** 2).mean()),
            "max_error": distance.max()}


def count_bits(path):
    """Bits of every dataset that the decoder reads."""
    bits = []
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: bits.append(8 * item.size)
                        if isinstance(item, h5py.Dataset) and name.split("/")[-1] == "bitstream" else None)
    return sum(bits)


class ProgramTest(unittest.TestCase):
    """A folder for each test, and the program run in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="batchenc-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def command(self, *arguments):
        return [BINARY, *map(str, arguments)]

    def run_program(self, *arguments, expect=0, **options):
        done = subprocess.run(self.command(*arguments), cwd=self.folder, capture_output=True, text=True,
                              timeout=300, **options)
        self.assertEqual(done.returncode, expect, f"{arguments}\n{done.stdout}\n{done.stderr}")
        return done

    def write_clip(self, path, positions, triangles=None, **attributes):
        with h5py.File(self.folder / path, "w") as file:
            file["positions"] = positions
            if triangles is not None:
                file["triangles"] = triangles
            file.attrs.update(attributes)
        return self.folder / path

    def write_job(self, name, source, output=None, clusters=4, components=5, more="", frames=None):
        span = f", frames: [{frames[0]}, {frames[1]}]" if frames else ""
        path = self.folder / f"{name}.yaml"
        path.write_text(f"batchenc: 1\nname: {name}\ninput: {{file: {source}{span}}}\n"
                        f"output: {output or f'out/{name}.h5'}\n"
                        f"segmentation: {{method: clustering, clusters: {clusters}}}\n"
                        f"codec: {{method: rlpca, components: {components}}}\n{more}")
        return path

    def read_clip(self, name):
        with h5py.File(self.folder / name, "r") as file:
            return file["positions"][()], file["triangles"][()] if "triangles" in file else None

    def info(self, result):
        return json.loads(self.run_program("info", result, "--json").stdout)

    def files(self, folder="out"):
        path = self.folder / folder
        return sorted(entry.name for entry in path.iterdir()) if path.exists() else []

    def assert_close(self, a, b, name):
        """Equal to 1e-6 of the larger; None stands for undefined."""
        if a is None or b is None:
            self.assertEqual(a, b, name)
        else:
            self.assertLessEqual(abs(a - b), 1e-6 * max(abs(a), abs(b)), f"{name}: {a} and {b}")

    def check_result(self, result, source, triangles):
        """Decodes, verifies, and measures again; the metrics that were recorded must be the ones found."""
        self.run_program("decode", result, "-o", "decoded.h5", "--overwrite")
        decoded, decoded_triangles = self.read_clip("decoded.h5")
        self.assertEqual(decoded.dtype, np.float32)
        self.assertTrue(np.isfinite(decoded).all())
        if triangles is None:
            self.assertIsNone(decoded_triangles)
        else:
            np.testing.assert_array_equal(decoded_triangles, triangles)
        metrics = self.info(result)["metrics"]
        for name, value in measure(source, decoded).items():
            self.assert_close(metrics[name], value, name)
        bits = count_bits(self.folder / result)
        self.assertEqual(metrics["bits_total"], bits)
        self.assert_close(metrics["bpvf"], bits / (source.shape[0] * source.shape[1]), "bpvf")
        self.assertEqual(bits, sum(value for name, value in metrics.items()
                                   if name.startswith("bits_") and name != "bits_total"))
        return decoded
