"""A second decoder, written from docs/FORMAT.md alone and sharing no code with the program: for reading, and as the
proof that the document says enough. Slow; every step stands as plainly as it can. Integers are in
independent_streams.py, triangles in independent_connectivity.py (independent_bits.py, independent_surface.py and
independent_order.py are its coder 2), the static coder in independent_static.py (independent_bending.py,
independent_surface_gluing.py and independent_vectors.py are parts of it), SplitCoder in
independent_split.py, PDCT in independent_pdct.py (independent_transform.py is its transform), RTPCA in
independent_rtpca.py (independent_mixed.py, independent_tracks.py and independent_fields.py are parts of it;
test_rtpca_decoder.py compares it with the program), RLPCA here; independent_clusters.py has what these three share.

Usage: independent_decoder.py BATCHENC         encodes small clips with the program and compares both decoders
       independent_decoder.py RESULT.h5 CLIP.h5    decodes a result
Exits 0 when all agrees, 1 when not, 77 without h5py and numpy.
"""

import math
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    print("skipped: needs python3-h5py and python3-numpy")
    sys.exit(77)

from independent_clusters import (Contexts, decode_paths, decode_segmentation, decode_series, local_frames, mean_level,
                                  neighbour_lists, open_streams, parse_clip, place_seeds, split_members)
from independent_connectivity import decode_connectivity
from independent_pdct import decode_pdct
from independent_rtpca import decode_rtpca
from independent_split import decode_split
from independent_static import decode_static
from independent_streams import Corrupt, Reader, int32, need
from independent_transform import check_transform


# RLPCA


def traverse(members, owner, cluster, neighbours):
    """The vertices in order, and for each the places of its predecessors."""
    order, predecessors, place = [], [], {}
    for root in members:
        if root in place:
            continue
        place[root] = len(order)
        order.append(root)
        at = place[root]
        while at < len(order):
            found = []
            for w in neighbours[order[at]]:
                if owner[w] != cluster:
                    continue
                if w not in place:
                    place[w] = len(order)
                    order.append(w)
                elif place[w] < at and len(found) < 4:
                    found.append(place[w])
            predecessors.append(found)
            at += 1
    return order, predecessors


def decode_column(stream, contexts, predecessors):
    choice, model = contexts.begin_run(stream, 2)
    column = []
    for places in predecessors:
        for k in range(3):
            prediction = mean_level([column[3 * place + k] for place in places]) if choice == 1 else 0
            value = int32(prediction + stream.value(model))
            need(abs(value) <= 2**21, "a level beyond the scale")
            column.append(value)
    return column


def read_quantizer(reader):
    low, step = reader.get("f"), reader.get("f")
    need(math.isfinite(low) and math.isfinite(step) and step >= 0, "a quantiser out of range")
    return low, step


def dequantize(values, quantizer, bits):
    low, step = quantizer
    zero = 0 if step == 0 else math.floor(min(max((0 - low) / step + 0.5, 0), 2**bits))
    levels = np.array(values, np.int64) + zero
    need(np.all((levels >= 0) & (levels <= 2**bits)), "a level beyond the scale")
    return np.float32(low) + levels.astype(np.float32) * np.float32(step)


def decode_clip(data, triangles, components=None):
    """Positions [F,V,3], from the first `components` components."""
    method, vertex_count, frame_count, sections = parse_clip(data)
    if method == 1:
        return decode_static(sections, triangles, vertex_count, frame_count)
    if method == 2:
        return decode_split(sections, triangles, vertex_count, frame_count)
    if method == 5:
        return decode_pdct(sections, triangles, vertex_count, frame_count)
    if method == 6:
        return decode_rtpca(sections, triangles, vertex_count, frame_count, components)
    reader = Reader(sections[1])
    space, basis_bits, coefficient_bits, frame_bits = (reader.get("B") for _ in range(4))
    asked, cluster_count = reader.varint(4096), reader.varint(min(65535, vertex_count))
    center, e_max = np.array([reader.get("f") for _ in range(3)]), reader.get("f")
    need(space <= 1 and 2 <= basis_bits <= 20 and 2 <= coefficient_bits <= 20 and 4 <= frame_bits <= 22, "bits")
    need(asked and cluster_count and np.isfinite(center).all() and 0 <= e_max < math.inf, "parameters")
    need(reader.left() == 0, "bytes left over")
    local, clusters = space == 0, range(cluster_count)

    need(all(0 <= v < vertex_count for t in triangles for v in t), "triangles of another clip")
    need(vertex_count <= (8 * len(sections[2]) + 64) * 3024, "more vertices than the bytes can hold")
    neighbours = neighbour_lists(triangles, vertex_count)
    labels, seeds = decode_segmentation(sections[2], vertex_count, cluster_count, local, neighbours)
    owner, members = split_members(labels, seeds, cluster_count)
    orders, predecessors = zip(*(traverse(members[i], owner, i, neighbours) for i in clusters))

    paths = {}
    if local:
        paths = decode_paths(sections[3], cluster_count, frame_count, frame_bits)
    else:
        need(not sections[3], "frames in world space")

    reader = Reader(sections[4])
    coded, quantizers = [], []
    for i in clusters:
        coded.append(reader.varint(min(asked, 3 * len(orders[i]), frame_count)))
        quantizers.append(read_quantizer(reader) if coded[i] else None)
    used = coded if components is None else [min(components, count) for count in coded]
    bases = [[] for _ in clusters]
    for dealt, stream in open_streams(reader, [3 * len(orders[i]) * coded[i] for i in clusters]):
        contexts = Contexts()
        for component in range(max(used)):
            for i in dealt:
                if component < used[i]:
                    column = decode_column(stream, contexts, predecessors[i])
                    bases[i].append(dequantize(column, quantizers[i], basis_bits))
        if used == coded:
            stream.finish()

    reader = Reader(sections[5])
    quantizers = [read_quantizer(reader) if count else None for count in coded]
    coefficients = [[] for _ in clusters]
    for dealt, stream in open_streams(reader, [frame_count * count for count in coded]):
        contexts = Contexts()
        for component in range(max(used)):
            for i in dealt:
                if component < used[i]:
                    row = decode_series(stream, contexts, frame_count)
                    coefficients[i].append(dequantize(row, quantizers[i], coefficient_bits))
        if used == coded:
            stream.finish()

    positions, step = np.zeros((frame_count, vertex_count, 3)), e_max / 2**frame_bits
    for i in clusters:
        rotations, origins = np.tile(np.eye(3), (frame_count, 1, 1)), np.tile(center, (frame_count, 1))
        if local:
            rotations, origins = local_frames(paths[i], center, step)
        q = np.zeros((3 * len(orders[i]), frame_count))
        if used[i]:
            q = np.array(bases[i], np.float64).T @ np.array(coefficients[i], np.float64)
        q = q.T.reshape(frame_count, len(orders[i]), 3)
        positions[:, list(orders[i])] = q @ rotations + origins[:, None]  # a row times T is T transposed times a column
    place_seeds(positions, seeds, paths, center, step)
    return positions


def decode_result(path, components=None):
    """Positions [F,V,3] and triangles [T,3] of a result."""
    with h5py.File(path, "r") as file:
        triangles = []
        if "connectivity" in file:
            vertex_count, triangles = decode_connectivity(file["connectivity/bitstream"][()].tobytes())
            need(vertex_count == file.attrs["vertex_count"], "vertices of another clip")
        clips = [decode_clip(file["clips"][name]["bitstream"][()].tobytes(), triangles, components)
                 for name in sorted(file["clips"], key=int)]
    return np.concatenate(clips), np.array(triangles, np.int32).reshape(-1, 3)


# Comparison with the program

CASES = [
    # name, synth kind, vertices, frames, job keys, --components of decode
    ("jelly", "jelly", 300, 20, "segmentation: {clusters: 6}\ncodec: {components: 8}\n", None),
    ("progressive", "jelly", 300, 20, "segmentation: {clusters: 6}\ncodec: {components: 8}\n", 3),
    ("walker", "walker", 600, 60, "segmentation: {clusters: 20}\ncodec: {components: 10}\n", None),
    ("clips", "flag", 400, 30, "clips: {length: 13}\nsegmentation: {clusters: 5}\ncodec: {basis_bits: 20}\n", None),
    ("orlpca", "walker", 600, 30, "segmentation: {clusters: 12}\ncodec: {method: orlpca, target: {da: 0.5}}\n", None),
    ("orlpca-progressive", "jelly", 300, 20,
     "clips: {length: 12}\nsegmentation: {clusters: 6}\ncodec: {method: orlpca, target: {bpvf: 12}}\n", 4),
    ("orlpca-world", "flag", 300, 20,
     "segmentation: {clusters: 3}\ncodec: {method: orlpca, space: world, rate: vectors, target: {components: 9}}\n", None),
    ("world", "walker", 300, 25, "segmentation: {clusters: 1}\ncodec: {space: world, components: 20}\n", None),
    ("sparse", "flag", 500, 12, "segmentation: {clusters: 4}\ncodec: {components: 5}\n", None),
    ("points", "jelly", 200, 15, "segmentation: {clusters: 4}\ncodec: {components: 5}\n", None),
    ("long", "jelly", 24000, 1, "segmentation: {clusters: 1}\n", None),  # points; counts are halved
    ("still", "flag", 200, 1, "segmentation: {clusters: 3}\n", None),
    *((f"static-{predictor}", "walker", 400, 3, f"codec: {{method: static, bits: {bits}, predictor: {predictor}}}\n", None)
      for predictor, bits in (("parallelogram", 12), ("multiway", 8), ("local-parallelogram", 10), ("local-multiway", 14),
                              ("fitted", 12), ("auto", 6))),
    *((f"static-{name}", "walker", 400, 2, f"codec: {{method: static, bits: {bits}, predictor: {keys}}}\n", None)
      for name, bits, keys in (("touma", 12, "touma-gotsman, tangential: parallelogram"),
                               ("hope", 12, "hope"), ("hope-far", 24, "hope, fit_vertices: 64, fit_exponent: 8"),
                               ("hopi", 10, "hopi, tangential: weighted"), ("hopi-few", 8, "hopi, fit_vertices: 4"),
                               ("hops", 12, "hops, tangential: multiway, fit_cosine: 0"), ("weighted", 14, "weighted"))),
    *((f"static-odd-{predictor}", "flag", 400, 1,
       f"codec: {{method: static, predictor: {predictor}, tangential: weighted}}\n", None)
      for predictor in ("touma-gotsman", "hope", "hopi", "hops", "weighted")),
    *((f"static-collapsed-{predictor}", "jelly", 400, 1, f"codec: {{method: static, predictor: {predictor}}}\n", None)
      for predictor in ("fitted", "weighted", "hopi")),
    ("static-odd", "flag", 500, 3, "codec: {method: static, predictor: fitted}\n", None),
    ("static-sparse", "flag", 500, 2, "codec: {method: static, predictor: local-multiway}\n", None),
    ("static-fine", "jelly", 200, 2, "codec: {method: static, bits: 24, predictor: fitted}\n", None),
    ("static-free", "flag", 500, 2, "order: free\ncodec: {method: static, bits: 9}\n", None),
    ("static-soup", "jelly", 500, 1, "codec: {method: static, bits: 6}\n", None),
    ("static-soup-free", "jelly", 500, 1, "order: free\ncodec: {method: static, bits: 6}\n", None),
    ("free", "walker", 600, 20, "order: free\nsegmentation: {clusters: 6}\ncodec: {components: 5}\n", None),
    ("static-points", "jelly", 200, 2, "codec: {method: static, bits: 9}\n", None),
    ("pdct-spatial", "walker", 300, 20, "segmentation: {clusters: 5}\ncodec: {method: pdct}\n", None),
    ("pdct-spatial-few", "flag", 300, 12, "segmentation: {clusters: 4}\ncodec: {method: pdct, bits: 8, keep: 0.2}\n", None),
    ("pdct-over-mesh", "walker", 300, 20,
     "segmentation: {clusters: 12}\ncodec: {method: pdct, allocation: rd, bits: 10}\n", None),
    ("pdct-temporal", "walker", 300, 19,
     "segmentation: {clusters: 4}\ncodec: {method: pdct, transform: temporal, block: 4, intra_bits: 16}\n", None),
    ("pdct-temporal-rd", "jelly", 300, 20,
     "segmentation: {clusters: 3}\ncodec: {method: pdct, transform: temporal, block: 8, allocation: rd, bits: 9}\n", None),
    ("pdct-free", "flag", 300, 6, "order: free\nsegmentation: {clusters: 3}\ncodec: {method: pdct, bits: 20}\n", None),
    ("pdct-crowded", "jelly", 150, 6,
     "segmentation: {clusters: 100}\ncodec: {method: pdct, transform: temporal, block: 16}\n", None),
    ("pdct-still", "flag", 200, 1, "segmentation: {clusters: 3}\ncodec: {method: pdct}\n", None),
    ("pdct-points", "jelly", 200, 12, "segmentation: {clusters: 7}\ncodec: {method: pdct, intra_bits: 9}\n", None),
    ("pdct-points-prime", "walker", 200, 9, "segmentation: {clusters: 1}\ncodec: {method: pdct, allocation: rd}\n", None),
    ("pdct-points-temporal", "jelly", 200, 15,
     "segmentation: {clusters: 4}\ncodec: {method: pdct, transform: temporal, block: 5, allocation: rd}\n", None),
    ("pdct-points-still", "flag", 200, 1, "segmentation: {clusters: 2}\ncodec: {method: pdct}\n", None),
    *((f"split-{name}", kind, vertices, frames, f"codec: {{method: splitcoder, predictor: fitted, bits: {bits}}}\n", None)
      for name, kind, vertices, frames, bits in (
          ("mesh", "jelly", 300, 14, 12), ("pieces", "walker", 300, 14, 11), ("open", "flag", 300, 6, 12),
          ("points", "walker", 200, 12, 12), ("one", "walker", 200, 1, 12), ("two", "walker", 200, 2, 12),
          ("coarse", "walker", 300, 14, 5), ("fine", "walker", 200, 14, 16),
          ("odd", "flag", 200, 6, 12), ("soup", "jelly", 500, 4, 10))),
    ("split-exact", "jelly", 100, 4, "codec: {method: splitcoder, predictor: fitted, target: {max_error: 1e-12}}\n", None),
    *((f"split-{predictor}-{normal}", kind, 120, 5,
       f"codec: {{method: splitcoder, predictor: {predictor}, normal: {normal}, bits: {bits}}}\n", None)
      for predictor, normal, kind, bits in (
          ("time", "time", "walker", 11), ("space-multiway", "space", "flag", 8), ("space-time", "space-time", "jelly", 14),
          ("local-multiway", "time", "walker", 12), ("lorenzo-multiway", "time", "flag", 5), ("replica", "time", "jelly", 10))),
    ("streams", "jelly", 4000, 30, "segmentation: {clusters: 8}\ncodec: {components: 12}\n", None),
]


def shuffle_triangles(path):
    """Triangles in any order, some turned over, one degenerate, one twice: every way to attach a triangle occurs."""
    generator = np.random.default_rng(1)
    with h5py.File(path, "r+") as file:
        triangles = generator.permutation(file["triangles"][()])
        triangles[::7] = triangles[::7, ::-1]
        triangles[1] = triangles[0]
        triangles[2, 1] = triangles[2, 0]
        file["triangles"][...] = triangles


def soup():
    """All that is no surface: a full and an open fan of 300, a strip with a twist, edges of many triangles, any triangles
    on few vertices, repeated and degenerate ones."""
    strip = [300 + k for k in range(40)] + [301, 300]
    triangles = [(0, k + 1, (k + 1) % 300 + 1) for k in range(300)] + [(341, k, k + 1) for k in range(1, 300)]
    triangles += [tuple(strip[k:k + 3]) for k in range(40)] + [(342, 343, 344 + k) for k in range(9)]
    generator = np.random.default_rng(2)
    return np.concatenate([triangles, generator.integers(360, 372, (150, 3)), generator.integers(380, 480, (150, 3)),
                           triangles[-3:]]).astype(np.int32)


def check_older_coder():
    """Connectivity coder 1, which the program no longer writes."""
    squares = [5 * y + x for y in range(3) for x in range(4)]
    triangles = [t for a in squares for t in ((a, a + 1, a + 5), (a + 1, a + 6, a + 5))]
    triangles[::7] = [t[::-1] for t in triangles[::7]]
    triangles = triangles[::2] + triangles[1::2]
    triangles += [triangles[3], (19, 19, 2), (7, 21, 0)]
    written = bytes.fromhex("42454e4d0101161b462f46e05c00d78b5e005016bdc46ba2fba03eff9f8b211b050d090805030e0808090a090d02"
                            "071805060709080d05050412031000060e0508090504010d203c303e7c108151001d4e13e5")
    need(decode_connectivity(written) == (22, list(map(list, triangles))), "triangles of connectivity coder 1 differ")
    print(f"{'coder 1':<24} {len(triangles):>6} triangles alike")


def run(binary, folder, *arguments):
    done = subprocess.run([binary, *map(str, arguments)], cwd=folder, capture_output=True, text=True, timeout=300)
    need(done.returncode == 0, f"{arguments}: exit code {done.returncode}\n{done.stderr}")


def compare(binary, folder, name, kind, vertices, frames, keys, components):
    run(binary, folder, "synth", kind, "-o", f"{name}.h5", "--vertices", vertices, "--frames", frames)
    if name in ("points", "long", "static-points", "split-points") or name.startswith("pdct-points"):
        with h5py.File(folder / f"{name}.h5", "r+") as file:
            del file["triangles"]
            if name == "pdct-points-prime":  # 59 points and a seed triangle
                positions = file["positions"][:, :62]
                del file["positions"]
                file["positions"] = positions
    if name == "world" or name.startswith(("static-odd", "split-odd")):
        shuffle_triangles(folder / f"{name}.h5")
    if name.startswith("static-collapsed"):  # triangles without a normal
        with h5py.File(folder / f"{name}.h5", "r+") as file:
            positions = file["positions"][()]
            positions[:, ::3] = positions[:, :1]
            file["positions"][...] = positions
    if name.startswith(("static-soup", "split-soup")):
        with h5py.File(folder / f"{name}.h5", "r+") as file:
            del file["triangles"]
            file["triangles"] = soup()
    if name in ("sparse", "static-sparse"):  # so few triangles that vertices share slots
        with h5py.File(folder / f"{name}.h5", "r+") as file:
            triangles = file["triangles"][()][::9]
            del file["triangles"]
            file["triangles"] = triangles
    (folder / f"{name}.yaml").write_text(f"batchenc: 1\ninput: {{file: {name}.h5}}\noutput: out/{name}.h5\n{keys}")
    run(binary, folder, f"{name}.yaml")
    further = [] if components is None else ["--components", components]
    run(binary, folder, "decode", f"out/{name}.h5", "-o", f"decoded-{name}.h5", *further)
    with h5py.File(folder / f"decoded-{name}.h5", "r") as file:
        expected = file["positions"][()].astype(np.float64)
        expected_triangles = file["triangles"][()] if "triangles" in file else np.zeros((0, 3), np.int32)
    positions, triangles = decode_result(folder / "out" / f"{name}.h5", components)
    need(np.array_equal(triangles, expected_triangles), f"{name}: the triangles differ")
    need(positions.shape == expected.shape, f"{name}: {positions.shape} and {expected.shape}")
    side = np.ptp(expected.reshape(-1, 3), axis=0).max()
    difference = np.abs(positions - expected).max() / side
    print(f"{name:<24} {len(triangles):>6} triangles alike, positions within {difference:.1e} of the largest side")
    exact = name.startswith(("static", "split"))  # where decoding feeds back, every bit is the same
    need(difference <= (0 if exact else 1e-5), f"{name}: the positions differ")


def main():
    if len(sys.argv) == 3:
        positions, triangles = decode_result(sys.argv[1])
        with h5py.File(sys.argv[2], "w") as file:
            file["positions"] = positions.astype(np.float32)
            if len(triangles):
                file["triangles"] = triangles
        return
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    binary = Path(sys.argv[1]).resolve()
    check_older_coder()
    check_transform()
    with tempfile.TemporaryDirectory(prefix="batchenc-") as folder:
        for case in CASES:
            compare(binary, Path(folder), *case)


if __name__ == "__main__":
    try:
        main()
    except Corrupt as error:
        sys.exit(f"independent_decoder.py: {error}")
