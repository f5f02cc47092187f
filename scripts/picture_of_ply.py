#!/usr/bin/python3
"""Draws a coloured PLY as PNG, seen from the side, with numpy alone: the pictures of docs/SEGMENTATION.md.

Usage: scripts/picture_of_ply.py MESH.ply PICTURE.png [--turn DEGREES] [--tilt DEGREES] [--up x|y|z] [--size PIXELS]
Takes what `batchenc segment --ply` writes: binary little-endian, triangles, a colour a vertex.
"""

import argparse
import struct
import sys
import zlib

import numpy as np


def read_ply(path):
    with open(path, "rb") as file:
        data = file.read()
    header, _, body = data.partition(b"end_header\n")
    lines = header.decode().splitlines()
    if lines[:2] != ["ply", "format binary_little_endian 1.0"]:
        sys.exit(f"{path}: no binary little-endian PLY")
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    vertices = np.frombuffer(body, [("place", "<f4", 3), ("color", "u1", 3)], counts["vertex"])
    faces = np.frombuffer(body, [("count", "u1"), ("corners", "<i4", 3)], counts["face"], vertices.nbytes)
    return vertices["place"].astype(float), vertices["color"].astype(float), faces["corners"]


def rotation(turn, tilt):
    turn, tilt = np.radians([turn, tilt])
    about_up = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    about_right = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    return about_right @ about_up


def draw(places, colors, faces, size):
    """A z-buffer, triangle by triangle, each in the colour of its corners, lit from the eye."""
    low, high = places.min(0), places.max(0)
    scale = 0.94 * size / max(high[:2] - low[:2])
    places = (places - (low + high) / 2) * scale
    width, height = (np.ceil((high - low)[:2] * scale / 0.94)).astype(int)
    x, y, z = places[:, 0] + width / 2, height / 2 - places[:, 1], places[:, 2]
    picture, depth = np.full((height, width, 3), 255.0), np.full((height, width), -np.inf)
    normals = np.cross(places[faces[:, 1]] - places[faces[:, 0]], places[faces[:, 2]] - places[faces[:, 0]])
    light = 0.35 + 0.65 * np.abs(normals[:, 2]) / (np.linalg.norm(normals, axis=1) + 1e-12)
    for corners, shade in zip(faces, light):
        (x0, x1, x2), (y0, y1, y2) = x[corners], y[corners]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0:
            continue
        left, right = max(0, int(min(x0, x1, x2))), min(width - 1, int(max(x0, x1, x2)) + 1)
        top, bottom = max(0, int(min(y0, y1, y2))), min(height - 1, int(max(y0, y1, y2)) + 1)
        px, py = np.meshgrid(np.arange(left, right + 1) + 0.5, np.arange(top, bottom + 1) + 0.5)
        b = ((px - x0) * (y2 - y0) - (x2 - x0) * (py - y0)) / area
        c = ((x1 - x0) * (py - y0) - (px - x0) * (y1 - y0)) / area
        weights = np.stack([1 - b - c, b, c], axis=-1)
        here = weights @ z[corners]
        region = np.s_[top:bottom + 1, left:right + 1]
        visible = (weights >= -1e-9).all(axis=-1) & (here > depth[region])
        depth[region][visible] = here[visible]
        # The nearest corner's colour, so that borders between clusters stay sharp.
        picture[region][visible] = shade * colors[corners[weights[visible].argmax(axis=-1)]]
    return picture


def write_png(path, picture):
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + row.tobytes() for row in picture.clip(0, 255).astype(np.uint8))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh")
    parser.add_argument("picture")
    parser.add_argument("--turn", type=float, default=30)
    parser.add_argument("--tilt", type=float, default=10)
    parser.add_argument("--up", choices="xyz", default="y")
    parser.add_argument("--size", type=int, default=360)
    options = parser.parse_args()
    places, colors, faces = read_ply(options.mesh)
    axes = {"x": [1, 0, 2], "y": [0, 1, 2], "z": [0, 2, 1]}[options.up]
    sign = np.array([1, 1, 1 if options.up == "y" else -1])
    places = (places[:, axes] * sign) @ rotation(options.turn, options.tilt).T
    # Twice the size and averaged: smooth edges.
    large = draw(places, colors, faces, 2 * options.size)
    large = large[:large.shape[0] // 2 * 2, :large.shape[1] // 2 * 2]
    write_png(options.picture, large.reshape(large.shape[0] // 2, 2, large.shape[1] // 2, 2, 3).mean(axis=(1, 3)))


main()
