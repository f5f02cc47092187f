"""What RLPCA, PDCT and RTPCA of docs/FORMAT.md share: a clip's sections, segmentation, streams, series and LCFs; a part of
independent_decoder.py."""

import numpy as np

from independent_streams import Model, Reader, Stream, crc32c, int32, need


def parse_clip(data):
    reader = Reader(data)
    need(reader.take(4) == b"BENC" and reader.get("B") == 1, "no clip of version 1")
    method = reader.get("B")
    need(1 <= method <= 6, "no known method")
    vertex_count, frame_count = reader.varint(2**31 - 1), reader.varint(2**31 - 1)
    table = [(reader.get("B"), reader.varint(len(data))) for _ in range(reader.varint(6))]
    numbers = [number for number, _ in table]
    need(numbers == sorted(set(numbers)) and set(numbers) <= set(range(1, 7)), "sections out of order")
    need(crc32c(data[:reader.at]) == reader.get("I"), "checksum of the clip's header")
    need(vertex_count and frame_count, "a clip without vertices or frames")
    sections = dict.fromkeys(range(1, 7), b"")
    for number, size in table:
        sections[number] = reader.take(size)
        need(crc32c(sections[number]) == reader.get("I"), f"checksum of section {number}")
    need(reader.left() == 0, "bytes left over")
    return method, vertex_count, frame_count, sections


def neighbour_lists(triangles, vertex_count):
    neighbours = [[] for _ in range(vertex_count)]
    for a, b, c in triangles:
        neighbours[a].append(b)
        neighbours[b].append(c)
        neighbours[c].append(a)
    return neighbours


def decode_segmentation(payload, vertex_count, cluster_count, local, neighbours):
    stream, agreed, disputed = Stream(payload), Model(0.1), Model(0.5)
    labels = []
    for v in range(vertex_count):
        known = [labels[w] for w in neighbours[v] if w < v]
        first = known[0] if known else labels[v - 1] if v else 0
        second = next((label for label in known if label != first), None)
        symbol = stream.value(agreed if second is None else disputed)
        label = first if symbol == 0 else second if symbol == 1 else symbol - 2
        need(label is not None and 0 <= label < cluster_count, "no such label")
        labels.append(label)
    anchor, other, seeds, last = Model(vertex_count / (cluster_count + 1)), Model(64.0), [], 0
    for _ in range(cluster_count if local else 0):
        a = last + stream.value(anchor)
        b = a + stream.value(other)
        c = a + stream.value(other)
        need(0 <= min(a, b, c) and max(a, b, c) < vertex_count, "no such seed triangle")
        seeds.append((a, b, c))
        last = a
    stream.finish()
    return labels, seeds


def split_members(labels, seeds, cluster_count):
    """The owner of each vertex, -1 at the corners of seed triangles, and the vertices of each cluster."""
    owner = list(labels)
    for t in seeds:
        for v in t:
            owner[v] = -1
    members = [[] for _ in range(cluster_count)]
    for v, i in enumerate(owner):
        if i != -1:
            members[i].append(v)
    return owner, members


def deal_streams(sizes, values):
    count = min(max((sum(sizes) + values // 2) // values, 1), len(sizes))
    streams, loads = [[] for _ in range(count)], [0] * count
    for i in sorted(range(len(sizes)), key=lambda i: (-sizes[i], i)):
        least = loads.index(min(loads))
        streams[least].append(i)
        loads[least] += sizes[i]
    return streams


def open_streams(reader, sizes, least=None, values=65536):
    """Pairs of clusters and the stream that holds them. A cluster has `least` values at least, otherwise its size."""
    dealt = deal_streams(sizes, values)
    least = least or sizes
    lengths = [reader.varint(reader.left()) for _ in dealt]
    parts = [reader.take(length) for length in lengths]
    need(reader.left() == 0, "bytes left over")
    for clusters, part in zip(dealt, parts):
        need(sum(least[i] for i in clusters) <= (8 * len(part) + 64) * 3024, "more values than the bytes can hold")
    return [(clusters, Stream(part)) for clusters, part in zip(dealt, parts)]


class Contexts:
    """The models of one stream of section 3, 4 or 5."""

    def __init__(self):
        self.choice, self.change, self.last_class, self.classes = Model(1.0), Model(2.0), 16, {}
        self.starts = [Model(2000.0), Model(100.0), Model(30.0)]

    def begin_run(self, stream, choices):
        choice = stream.value(self.choice)
        need(0 <= choice < choices, "no such choice")
        self.last_class = min(max(int32(self.last_class + stream.value(self.change)), 0), 55)
        if self.last_class not in self.classes:
            odd = self.last_class % 2
            prior = (1.4142135623730951 if odd else 1.0) * 2.0**((self.last_class - odd) // 2 - 4)
            self.classes[self.last_class] = Model(prior)
        return choice, self.classes[self.last_class]


def decode_series(stream, contexts, length):
    order, model = contexts.begin_run(stream, 4)
    x = []
    for t in range(length):
        residual = stream.value(contexts.starts[t] if t < order else model)
        j = min(order, t)
        if j == 0:
            prediction = 0
        elif j == 1:
            prediction = x[t - 1]
        elif j == 2:
            prediction = 2 * x[t - 1] - x[t - 2]
        else:
            prediction = 3 * (x[t - 1] - x[t - 2]) + x[t - 3]
        x.append(int32(residual + prediction))
    return x


SHARES = [np.float32(0), np.float32(1), np.float32(0.5), np.float32(1) / np.float32(3), np.float32(0.25)]
ROUNDER = np.float32(12582912)


def mean_level(levels):
    """Of up to four predecessors, rounded."""
    return int((np.float32(sum(levels)) * SHARES[len(levels)] + ROUNDER) - ROUNDER)


def local_frames(s, center, step):
    """Rotations [F,3,3] and origins [F,3] of the nine series s[9][F]."""
    rotation, rotations = np.eye(3), []
    for u, w in zip(s[3:6].T, s[6:9].T):
        normal = np.cross(u, w)
        if u.any() and normal.any():
            x, z = u / np.linalg.norm(u), normal / np.linalg.norm(normal)
            rotation = np.array([x, np.cross(z, x), z])
        rotations.append(rotation)
    return np.array(rotations), center + step * (s[0:3] + 0.5 * s[3:6]).T


def decode_paths(payload, cluster_count, frame_count, frame_bits):
    """Nine series [9,F] of each cluster's seed triangle."""
    paths = {}
    for dealt, stream in open_streams(Reader(payload), [9 * frame_count] * cluster_count):
        contexts = Contexts()
        for i in dealt:
            paths[i] = np.array([decode_series(stream, contexts, frame_count) for _ in range(9)], np.float64)
            need(np.abs(paths[i]).max() <= 4 * 2**frame_bits, "a seed triangle outside the lattice")
        stream.finish()
    return paths


def place_seeds(positions, seeds, paths, center, step):
    for i in reversed(range(len(seeds))):
        p1 = paths[i][0:3]
        for corner, levels in enumerate((p1, p1 + paths[i][3:6], p1 + paths[i][6:9])):
            positions[:, seeds[i][corner]] = center + step * levels.T
