#!/usr/bin/python3
"""Reads a clip and a result back with h5py: a reader that shares no code with the writer.

hdf5_layout_test.py WRITER, where WRITER CLIP.h5 RESULT.h5 makes both. Exit code 77: h5py is not installed.
"""
import os
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy
except ImportError:
    print("skipped: h5py is not installed")
    sys.exit(77)


def text(value):
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def check(condition, what):
    if not condition:
        sys.exit(f"wrong: {what}")


def check_clip(path):
    with h5py.File(path, "r") as file:
        positions = file["positions"]
        check(positions.shape == (4, 5, 3) and positions.dtype == "<f4", "positions")
        f, v, k = numpy.indices((4, 5, 3))
        check((positions[:] == 100 * f + 10 * v + k).all(), "order of the axes")
        check(file["triangles"].dtype == "<i4", "type of the triangles")
        check(file["triangles"][:].tolist() == [[0, 1, 2], [2, 3, 4]], "triangles")
        check(file.attrs["fps"] == 24.0, "fps")
        check(text(file.attrs["name"]) == "läufer", "name")
        check(text(file.attrs["axis_order"]) == "[frame][vertex][xyz]", "axis_order")


def check_result(path):
    with h5py.File(path, "r") as file:
        texts = {"format": "batchenc", "method": "rlpca", "name": "dance",
                 "job": "name: dance\ncodec: {method: rlpca}\n"}
        for name, value in texts.items():
            check(text(file.attrs[name]) == value, name)
            check(not file.attrs.get_id(name).get_type().is_variable_str(), name + " of variable length")
        numbers = {"format_version": 1, "vertex_count": 5, "triangle_count": 2, "frame_count": 7, "fps": 24.0}
        for name, value in numbers.items():
            check(file.attrs[name] == value, name)
        check(set(file.attrs) == set(texts) | set(numbers) | {"digest"}, "root attributes")
        check(len(text(file.attrs["digest"])) == 32, "digest")
        check(set(file) == {"connectivity", "clips", "metrics", "analysis"}, "groups")
        check(list(file["clips"]) == ["000000", "000001"], "clips")
        streams = {"connectivity": (0xC0, 40), "clips/000000": (0xA1, 100), "clips/000001": (0xB2, 60)}
        for name, (value, size) in streams.items():
            stream = file[name]["bitstream"]
            check(stream.dtype == "u1" and stream.shape == (size,) and (stream[:] == value).all(), name)
            check(stream.chunks is None and stream.compression is None, name + " contiguous")
        spans = [(file["clips"][c].attrs["first_frame"], file["clips"][c].attrs["frame_count"])
                 for c in file["clips"]]
        check(spans == [(0, 4), (4, 3)], "spans")
        metrics = file["metrics"]
        check(metrics.attrs["bpvf"] == 2.5 and metrics.attrs["bpvf"].dtype == "<f8", "metrics")
        check(len(metrics.attrs) == 10, "number of metrics")
        check(metrics["frame_rmse"].dtype == "<f8", "type of the metrics")
        check(metrics["frame_rmse"][:].tolist() == [1, 2, 3, 4, 5, 6, 7], "frame_rmse")
        check(metrics["frame_max_error"][:].tolist() == [2, 4, 6, 8, 10, 12, 14], "frame_max_error")
        check(metrics["frame_jump"][:].tolist() == [0, 3, 6, 9, 12, 15, 18], "frame_jump")
        for clip in ("000000", "000001"):
            analysis = file["analysis"][clip]
            check(analysis["labels"].dtype == "<i4", "type of the labels")
            check(analysis["labels"][:].tolist() == [0, 1, 1, 0, 2], "labels")
            check(analysis["vertex_rmse"].dtype == "<f4", "type of the vertex errors")
            check(analysis["vertex_rmse"][:].tolist() == [0.5, 0.25, 0.125, 0, 1], "vertex_rmse")
            check(analysis["cluster_deviation"].dtype == "<f8", "type of the clusters' deviations")
            check(analysis["cluster_deviation"][:].tolist() == [0.25, 0, 1.5], "cluster_deviation")
    with open(path, "rb") as file:
        check(file.read(9) == b"\x89HDF\r\n\x1a\n\x02", "superblock version 2, which old MATLABs need")


with tempfile.TemporaryDirectory() as folder:
    clip, result = os.path.join(folder, "clip.h5"), os.path.join(folder, "result.h5")
    subprocess.run([sys.argv[1], clip, result], check=True)
    check_clip(clip)
    check_result(result)
