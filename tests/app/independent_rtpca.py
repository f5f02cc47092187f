"""RTPCA of docs/FORMAT.md; a part of independent_decoder.py. Its integers are in independent_mixed.py, tracks in
independent_tracks.py, fields in independent_fields.py."""

import math

import numpy as np

from independent_bending import PI, unit_vector
from independent_bits import AdaptiveBits, BitStream, Count, MixedBits
from independent_clusters import deal_streams, decode_segmentation, neighbour_lists
from independent_fields import FieldCoder, Memory, Mesh, Points
from independent_mixed import MixedInteger, ShortNumber, digits_of
from independent_pdct import order_points
from independent_streams import Reader, need
from independent_tracks import TrackCoder, values_of

single = np.float32
QUARTERS = [single(x) for x in (1.0, 0.840896415, 0.707106781, 0.594603558)]


class Parameters:
    def __init__(self, payload, vertex_count):
        reader = Reader(payload)
        self.step, self.e_max = reader.get("f"), reader.get("f")
        self.center = [reader.get("f") for _ in range(3)]
        self.cluster_count, self.component_count = reader.varint(min(65535, vertex_count)), reader.varint(2**31)
        need(np.isfinite([self.step, self.e_max, *self.center]).all(), "a number that is not finite")
        need(self.step >= 0 and self.e_max >= 0 and self.cluster_count, "parameters")
        need(reader.left() == 0, "bytes left over")

    def fine(self, n):
        return single(max(self.step / math.sqrt(max(1, n)), self.e_max * 2.0**-24))


def read_parts(reader, count):
    """Streams of bits, all but the last with their sizes before them."""
    sizes = [reader.varint(reader.left()) for _ in range(count - 1)]
    return [BitStream(reader.take(size)) for size in sizes] + [BitStream(reader.take(reader.left()))]


# Frames


def rotations_by(vectors):
    """Rows [F,3,3] of the rotations by vectors [F,3]."""
    result = np.tile(np.eye(3), (len(vectors), 1, 1))
    for rows, v in zip(result, vectors.tolist()):
        angle = math.sqrt((v[0] * v[0] + v[1] * v[1]) + v[2] * v[2])
        if not 0 < angle < 1e6:
            continue
        full = 2.0 * PI
        c, s = unit_vector(angle - full * math.floor(angle / full))
        k, d = [x / angle for x in v], 1.0 - c
        rows[...] = [[c + d * k[0] * k[0], d * k[0] * k[1] - s * k[2], d * k[0] * k[2] + s * k[1]],
                     [d * k[0] * k[1] + s * k[2], c + d * k[1] * k[1], d * k[1] * k[2] - s * k[0]],
                     [d * k[0] * k[2] - s * k[1], d * k[1] * k[2] + s * k[0], c + d * k[2] * k[2]]]
    return result


def turn_by(rotations, points):
    """R p, of [F,3,3] and [F,3] or [3]."""
    p = np.broadcast_to(points, rotations.shape[:2])[:, None]
    return (rotations[:, :, 0] * p[..., 0] + rotations[:, :, 1] * p[..., 1]) + rotations[:, :, 2] * p[..., 2]


def decode_frames(payload, parameters, sizes, frame_count):
    """Of each cluster its parent, -1 for the world, and R' [F,3,3] and t' [F,3], binary64."""
    stream, count = BitStream(payload), parameters.cluster_count
    parent_number, radius_number, joints = ShortNumber(digits_of(count)), ShortNumber(6), MixedInteger([1])
    coders = TrackCoder(frame_count), TrackCoder(frame_count)  # of rotations, of paths
    parents, own = [], []
    for n in sizes:
        parent, radius = parent_number.code(stream) - 1, radius_number.code(stream)
        need(parent < count and radius <= 48, "no such parent or radius")
        joint = [joints.code(stream, (0,)) * (parameters.e_max / 4096) for _ in range(3)]
        rotation, path = values_of([coder.code(stream, 0) for coder in coders])
        fine = float(parameters.fine(n))
        length = parameters.e_max * (0.70710678118654752 if radius % 2 else 1.0) * 2.0**-(radius // 2)
        turn = fine / length * 1.2247448713915890 if length else 0.0
        R = rotations_by(rotation.astype(np.float64) * turn)
        own.append((R, path.astype(np.float64) * fine - turn_by(R, joint)))
        parents.append(parent)
    stream.finish()
    return parents, own


def compose(parents, own):
    """Of each cluster R and t."""
    motions = {-1: None}
    for i in range(len(own)):
        chain = []
        while i not in motions:
            need(i not in chain, "clusters in a circle")
            chain.append(i)
            i = parents[i]
        for k in reversed(chain):
            R, t = own[k]
            if parents[k] != -1:
                outer, shift = motions[parents[k]]
                t = turn_by(outer, t) + shift
                R = np.stack([turn_by(outer, column) for column in np.moveaxis(R, 2, 0)], axis=2)
            motions[k] = R, t
    return [motions[i] for i in range(len(own))]


# Components


def decode_list(payload, parameters, sizes, frame_count):
    """(scale, cluster, rank) of each component."""
    stream, below, cluster_number = BitStream(payload), Count(), ShortNumber(digits_of(parameters.cluster_count - 1))
    found, ranks, scale = [], [0] * parameters.cluster_count, 255
    for _ in range(parameters.component_count):
        scale -= below.code(stream)
        need(scale >= 0, "a scale below 0")
        i = cluster_number.code(stream)
        need(i < parameters.cluster_count and ranks[i] < min(3 * frame_count, sizes[i]), "no such component")
        found.append((scale, i, ranks[i]))
        ranks[i] += 1
    stream.finish()
    return found


# Residuals


class Offsets:
    def __init__(self, data, order):
        self.stream, self.order = BitStream(data), order
        count = len(order.vertices)
        self.any, self.changes = AdaptiveBits(), MixedBits([64, 256, 16, 128], 1)
        self.integer = MixedInteger([12, 9, 9])
        self.offsets, self.last = [[0] * 3 for _ in range(count)], [(0, 0, 0)] * count
        self.changed = [None] * count  # in which frame
        self.before = 0

    def decode_frame(self, f):
        """How many vertices change."""
        if not self.any.code(self.stream):
            self.before = 0
            return 0
        count = 0
        spread = digits_of(16384 * self.before // len(self.offsets))
        for v, neighbours in enumerate(self.order.neighbours):
            now = [w for w in neighbours if self.changed[w] == f]
            past = sum(f > 0 and self.changed[w] == f - 1 for w in neighbours)
            k, moving, past = min(3, len(neighbours)), min(3, len(now)), min(3, past)
            age = 7 if self.changed[v] is None else min(6, digits_of(f - self.changed[v]) - 1)
            offset = self.offsets[v]
            off = int(any(offset))
            if not self.changes.code(self.stream, (2 * (4 * age + moving) + off, 16 * (4 * k + moving) + spread,
                                                   4 * past + moving, 16 * age + spread), 0):
                continue
            change = []
            for axis in range(3):
                moved = sum(c != 0 for c in change)
                signs = [1 + (u > 0) - (u < 0) for u in (sum(self.last[w][axis] for w in now), offset[axis])]
                change.append(self.integer.code(self.stream, (4 * axis + moved, 3 * signs[0] + signs[1],
                                                              3 * axis + signs[0])))
                offset[axis] = min(max(offset[axis] + change[axis], -2**24), 2**24)
            self.last[v], self.changed[v] = change, f
            count += 1
        self.before = count
        return count

    def current(self):
        """Offsets [V,3], and which vertices have had a change, in the order."""
        return np.array(self.offsets, single), np.array([f is not None for f in self.changed])


# Clips


def decode_rtpca(sections, triangles, vertex_count, frame_count, components=None):
    """Positions [F,V,3], float32, from the first `components` components."""
    parameters = Parameters(sections[1], vertex_count)
    clusters = range(parameters.cluster_count)
    need(all(0 <= v < vertex_count for t in triangles for v in t), "triangles of another clip")
    triangles = [tuple(map(int, t)) for t in triangles]
    labels, _ = decode_segmentation(sections[2], vertex_count, len(clusters), False,
                                    neighbour_lists(triangles, vertex_count))
    sizes = [0] * len(clusters)
    for i in labels:
        sizes[i] += 1
    motions = compose(*decode_frames(sections[3], parameters, sizes, frame_count))

    reader = Reader(sections[4])
    listed = decode_list(reader.take(reader.varint(reader.left())), parameters, sizes, frame_count)
    used = listed if components is None else listed[:components]
    values = [(sizes[i] + 3 * frame_count) * sum(cluster == i for _, cluster, _ in listed) for i in clusters]
    dealt = deal_streams(values, 131072)
    bases = {}  # by cluster and rank, [F,3]
    for chosen, stream in zip(dealt, read_parts(reader, len(dealt))):
        coder, mine = TrackCoder(frame_count), [(i, rank) for _, i, rank in used if i in chosen]
        tracks = [coder.code(stream, rank) for _, rank in mine]
        if used == listed:
            stream.finish()
        bases.update(zip(mine, values_of(tracks)))

    mean_stream, *streams = read_parts(Reader(sections[5]), 1 + len(dealt))
    is_mesh = len(triangles) > 0
    shape = Mesh(triangles, vertex_count) if is_mesh else Points()
    walk = shape.vertices if is_mesh else list(range(vertex_count))
    whole = shape.order(walk)
    coder, memory = FieldCoder(), Memory(whole)
    fields = [coder.code(mean_stream, memory)[1] for _ in range(3)]
    mean_stream.finish()
    mean = np.zeros((vertex_count, 3), single)
    mean[walk] = np.array(fields, single).T * parameters.fine(frame_count)
    if not is_mesh:
        walk = order_points(mean)
    members = [[v for v in walk if labels[v] == i] for i in clusters]
    memories = [Memory(shape.order(vertices)) for vertices in members]
    coefficients = {}
    for chosen, stream in zip(dealt, streams):
        coder = FieldCoder()
        for _, i, rank in used:
            if i in chosen:
                coefficients[i, rank] = np.array(coder.code(stream, memories[i])[1], single)
        if used == listed:
            stream.finish()

    positions = np.zeros((frame_count, vertex_count, 3), single)
    for i in clusters:
        R, t = motions[i][0].astype(single), (motions[i][1] + np.array(parameters.center)).astype(single)
        m = mean[members[i]]
        p = t[:, None]
        for axis in range(3):
            p = p + m[None, :, axis, None] * R[:, None, :, axis]
        for scale, cluster, rank in used:
            if cluster == i:
                power = QUARTERS[scale % 4] * single(2.0**-(scale // 4))
                b = bases[i, rank] * (single(1.25) * power * single(parameters.step))
                p = p + coefficients[i, rank][None, :, None] * turn_by(R, b)[:, None]
        positions[:, members[i]] = p

    if sections[6] and used == listed:
        reader = Reader(sections[6])
        bound = reader.get("d")
        need(0 < bound, "a bound out of range")
        step = single((bound * 1.1547005383792515) * (1 - 2.0**-9))
        need(step < np.finfo(single).max, "a bound out of range")
        offsets = Offsets(reader.take(reader.left()), whole)
        places, label = whole.vertices, np.array(labels)[whole.vertices]
        R = np.array([motion[0] for motion in motions], np.float64).astype(single)
        for f in range(frame_count):
            offsets.decode_frame(f)
            h, changed = offsets.current()
            moved = turn_by(R[label, f], step * h)
            at = np.array(places)[changed]
            positions[f, at] += moved[changed]
        offsets.stream.finish()
    return positions
