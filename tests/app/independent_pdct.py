"""PDCT of docs/FORMAT.md; a part of independent_decoder.py."""

import math

import numpy as np

from independent_clusters import (decode_paths, decode_segmentation, local_frames, mean_level, neighbour_lists,
                                  open_streams, parse_clip, place_seeds, split_members)
from independent_static import decode_static
from independent_streams import Model, Reader, int32, need
from independent_transform import inverse_cosine_transforms


# Levels


class Models:
    """Those of one stream."""

    def __init__(self):
        self.tails, self.classes = [Model() for _ in range(9)], {}

    def of_weight(self, weight):
        mantissa, exponent = math.frexp(float(np.float32(weight)))  # mantissa below 1
        c = 0 if weight == 0 else 1 + 2 * (exponent - 1) + (mantissa >= 0.75)
        if c not in self.classes:
            e = (c - 1) // 2
            self.classes[c] = Model(0.001 if c == 0 else (1.25 if c % 2 else 1.75) * 2.0**e / 512)
        return self.classes[c]


class Memory:
    """What a cluster of n vertices keeps of its rows, `rows` of them a block."""

    def __init__(self, n, rows):
        self.n, self.rows, self.seen = n, rows, 0
        self.means = [[0] * (3 * n) for _ in range(rows)]
        self.tails, self.last, self.opening = [0] * rows, [0] * (3 * n), [0] * (3 * n)

    def decode_row(self, stream, models, t):
        """Symbols of row t of a block."""
        n, mean, last = self.n, self.means[t], [*self.last, 0, 0, 0]  # an index below 0 finds these zeros
        a, b, c, *d = (10, 10, 28, 31, 25, 72, 8, 49) if self.rows == 1 else (5, 75, 5, 50, 33, 95, 10, 70)
        tail = stream.value(models.tails[self.tails[t]])
        need(0 <= tail <= 8, "no such tail")
        row, size = [0] * (3 * n), [0] * (3 * n + 6)
        for j in range(3 * ((n * tail + 7) // 8)):
            weight = a * mean[j] + b * last[j] + c * (last[j - 3] + last[j + 3])
            weight += d[0] * size[j - 1] + d[1] * size[j - 2] + d[2] * size[j - 3]
            weight += d[3] * (size[j - 4] + size[j - 5]) + d[4] * size[j - 6]
            row[j] = stream.value(models.of_weight(weight))
            size[j] = min(abs(row[j]), 65536)
        self.means[t] = [m + (16 * s - m + 2) // 4 for m, s in zip(mean, size)]
        self.last, self.tails[t] = size[:3 * n], tail
        self.seen = max(self.seen, t + 1)
        if t + 1 < self.rows and self.seen == t + 1:
            self.means[t + 1], self.tails[t + 1] = list(self.means[t]), tail
        if self.rows > 1:
            if t == 0:
                self.opening = self.last
            if t == self.rows - 1:
                self.last = self.opening
        return row


def sum_over_the_mesh(symbols, predecessors):
    levels = []
    for k, places in enumerate(predecessors):
        for c in range(3):
            level = int32(symbols[3 * k + c] + mean_level([levels[3 * place + c] for place in places]))
            need(abs(level) <= 2**21, "a level beyond the scale")
            levels.append(level)
    return levels


def sum_blocks(levels, lengths):
    """Adds to the first row of each block, `lengths` rows each, that of the block before."""
    start = 0
    for p, q in zip(lengths, lengths[1:]):
        before, first = levels[start], levels[start + p]
        if p != q:
            before = [math.floor(level * math.sqrt(q / p) + 0.5) for level in before]
        levels[start + p] = [int32(x + y) for x, y in zip(first, before)]
        start += p


# Orders


def walk_mesh(members, owner, cluster, neighbours):
    """The vertices in order."""
    order, placed = [], set()

    def free(v):
        return [w for w in neighbours[v] if owner[w] == cluster and w not in placed]

    for root in members:
        if root in placed:
            continue
        stack = [root]
        order.append(root)
        placed.add(root)
        while stack:
            found = free(stack[-1])
            if not found:
                stack.pop()
                continue
            v = min(found, key=lambda w: len(free(w)))
            order.append(v)
            placed.add(v)
            stack.append(v)
    return order


def find_predecessors(order, neighbours):
    places = {v: k for k, v in enumerate(order)}
    return [[places[w] for w in neighbours[v] if places.get(w, k) < k][:4] for k, v in enumerate(order)]


def hilbert_place(cell):
    cell = list(cell)
    bit = 2**15
    while bit > 1:
        for c in range(3):
            if cell[c] & bit:
                cell[0] ^= bit - 1
            else:
                k = (cell[0] ^ cell[c]) & (bit - 1)
                cell[0] ^= k
                cell[c] ^= k
        bit //= 2
    x, y, z = cell
    y ^= x
    z ^= y
    flips = 0
    for i in range(15, 0, -1):
        if z >> i & 1:
            flips ^= 2**i - 1
    place = 0
    for i in range(15, -1, -1):
        for u in (x, y, z):
            place = 2 * place + ((u ^ flips) >> i & 1)
    return place


def order_points(points):
    """Places of points [n,3] in their order along the curve."""
    points = np.array(points, np.float64)
    if not len(points) or not np.isfinite(points).all():
        return list(range(len(points)))
    low = points.min(axis=0)
    side = (points.max(axis=0) - low).max()
    if side == 0:
        return list(range(len(points)))
    cells = ((points - low) / side * 65535).astype(int)
    return sorted(range(len(points)), key=lambda k: (hilbert_place(map(int, cells[k])), k))


# Clips


def cosine_matrix(n):
    """What turns n coefficients into n samples."""
    i, k = np.mgrid[0:n, 0:n]
    matrix = math.sqrt(2 / n) * np.cos(math.pi * k * (2 * i + 1) / (2 * n))
    matrix[:, 0] = math.sqrt(1 / n)
    return matrix


def decode_pdct(sections, triangles, vertex_count, frame_count):
    """Positions [F,V,3]."""
    reader = Reader(sections[1])
    bits, intra_bits, frame_bits = (reader.get("B") for _ in range(3))
    block, cluster_count = reader.varint(256), reader.varint(min(65535, vertex_count))
    center, e_max = np.array([reader.get("f") for _ in range(3)]), reader.get("f")
    need(4 <= bits <= 20 and 4 <= intra_bits <= 20 and 4 <= frame_bits <= 22 and block and cluster_count, "bits")
    need(np.isfinite(center).all() and 0 <= e_max < math.inf and reader.left() == 0, "parameters")
    need(all(0 <= v < vertex_count for t in triangles for v in t), "triangles of another clip")
    need(vertex_count <= (8 * len(sections[2]) + 64) * 3024, "more vertices than the bytes can hold")
    clusters, points = range(cluster_count), len(triangles) == 0
    neighbours = neighbour_lists(triangles, vertex_count)
    labels, seeds = decode_segmentation(sections[2], vertex_count, cluster_count, True, neighbours)
    owner, members = split_members(labels, seeds, cluster_count)
    paths = decode_paths(sections[3], cluster_count, frame_count, frame_bits)
    lattice = e_max / 2**frame_bits
    frames = [local_frames(paths[i], center, lattice) for i in clusters]

    if points:
        need(not sections[6], "a first frame of points")
    else:
        method, count, first_count, first_sections = parse_clip(sections[6])
        need((method, count, first_count) == (1, vertex_count, 1), "no first frame of this clip")
        first_frame = decode_static(first_sections, triangles, vertex_count, 1)[0].astype(np.float64)

    reader = Reader(sections[5])
    packed = reader.take((cluster_count + 7) // 8)
    over_mesh = [packed[i // 8] >> i % 8 & 1 for i in clusters]
    sizes = [3 * len(members[i]) * frame_count for i in clusters]
    tails = [frame_count - 1 if members[i] else 0 for i in clusters]
    lengths = [min(block, frame_count - 1 - r) for r in range(0, frame_count - 1, block)]
    symbols, opening = [[] for _ in clusters], [None] * cluster_count
    for dealt, stream in open_streams(reader, sizes, tails, 1048576):
        models = Models()
        dealt = [i for i in dealt if members[i]]
        if points:
            for i in dealt:
                opening[i] = Memory(len(members[i]), 1).decode_row(stream, models, 0)
        memories = {i: Memory(len(members[i]), min(max(frame_count - 1, 1), block)) for i in dealt}
        for length in lengths:
            for i in dealt:
                symbols[i] += [memories[i].decode_row(stream, models, t) for t in range(length)]
        stream.finish()

    positions = np.zeros((frame_count, vertex_count, 3))
    for i in clusters:
        n, (rotations, origins) = len(members[i]), frames[i]
        if n == 0:
            continue
        if points:
            step = np.float32(e_max / 2**intra_bits)
            values = np.array(opening[i], np.int64).astype(np.float32).reshape(n, 3) * step
            first = inverse_cosine_transforms(values)
            places = order_points(first)
            order, first = [members[i][k] for k in places], first[places].astype(np.float64)
            predecessors = [list(range(max(k - 2, 0), k)) for k in range(n)]
        else:
            order = walk_mesh(members[i], owner, i, neighbours)
            first = (first_frame[order] - origins[0]) @ rotations[0].T
            predecessors = find_predecessors(order, neighbours)
        levels = [sum_over_the_mesh(row, predecessors) for row in symbols[i]] if over_mesh[i] else symbols[i]
        sum_blocks(levels, lengths)
        rows = np.array(levels, np.float64).reshape(-1, n, 3) * float(np.float32(e_max / 2**bits))
        if not over_mesh[i]:
            rows = np.einsum("kp,rpc->rkc", cosine_matrix(n), rows)
        if block > 1:
            starts = np.cumsum([0, *lengths])
            for at, length in zip(starts, lengths):
                rows[at:at + length] = np.einsum("tr,rpc->tpc", cosine_matrix(length), rows[at:at + length])
        local = np.concatenate([np.zeros((1, n, 3)), rows]) + first
        positions[:, order] = local @ rotations + origins[:, None]
    place_seeds(positions, seeds, paths, center, lattice)
    return positions
