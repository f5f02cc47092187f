"""SplitCoder of docs/FORMAT.md; a part of independent_decoder.py. Frames at gates are in independent_split_gates.py."""

import math
import struct

import numpy as np

from independent_clusters import parse_clip
from independent_pdct import order_points
from independent_split_gates import decode_gates
from independent_static import decode_static, traverse_mesh
from independent_streams import Model, Reader, Stream, crc32c, int32, need

f32 = np.float32
LARGEST_POINT = 2**29


# Places and neighbours


def edge_lists(triangles, vertex_count):
    """The vertices that each one shares an edge with, ascending."""
    found = [set() for _ in range(vertex_count)]
    for t in triangles:
        for v in t:
            found[v].update(t)
    return [sorted(ends - {v}) for v, ends in enumerate(found)]


def mesh_levels(lists, walk):
    lists, levels = [list(ends) for ends in lists], [None] * len(lists)
    for level in range(6, 0, -1):
        barred, taken = set(), []
        for size in range(3, 9):
            for v in walk:
                if levels[v] is None and len(lists[v]) == size and v not in barred:
                    levels[v] = level
                    taken.append(v)
                    barred.update([v, *lists[v]])
        for v in taken:
            for w in lists[v]:
                lists[w].remove(v)
            h, *others = lists[v]
            for w in others:
                if w not in lists[h]:
                    lists[h].append(w)
                    lists[w].append(h)
    return [level or 0 for level in levels]


def point_level(k):
    return 6 - min(6, (k & -k).bit_length() - 1) if k else 0


class Places:
    """The order of coding and, for each vertex, up to eight neighbours that come before it."""

    def __init__(self, triangles, first):
        count = len(first)
        self.positions = [[float(c) for c in p] for p in first]
        self.curve = order_points(first)
        self.along = {v: k for k, v in enumerate(self.curve)}
        self.lists = edge_lists(triangles, count)
        if triangles:
            walk = [visit[0] for visit in traverse_mesh(triangles, count)]
            self.levels = mesh_levels(self.lists, walk)
        else:
            walk = self.curve
            self.levels = [point_level(self.along[v]) for v in range(count)]
        self.order = sorted(walk, key=lambda v: self.levels[v])
        self.place = {v: k for k, v in enumerate(self.order)}

    def is_before(self, w, v):
        return self.levels[w] < self.levels[v] or self.levels[v] == 0 and self.place[w] < self.place[v]

    def distance(self, v, w):
        x, y, z = (a - b for a, b in zip(self.positions[v], self.positions[w]))
        return (x * x + y * y) + z * z

    def in_rings(self, v):
        seen, ring, found = {v}, [v], []
        for g in range(1, 7):
            wider = []
            for u in ring:
                for w in self.lists[u]:
                    if w not in seen:
                        seen.add(w)
                        wider.append(w)
            ring = wider
            found += [w for w in ring if self.is_before(w, v)]
            if g >= 2 and len(found) >= 8 or len(found) >= 24 or len(ring) > 512 or not ring:
                break
        return found

    def along_curve(self, v):
        found = []
        for step in (-1, 1):
            way = [self.along[v] + step * k for k in range(1, 257)]
            way = [self.curve[k] for k in way if 0 <= k < len(self.curve)]
            found += [w for w in way if self.is_before(w, v)][:12]
        return found

    def neighbours(self, v):
        found, close = self.in_rings(v), set(self.lists[v])
        if len(found) < 4:
            found, close = self.along_curve(v), set()
        return sorted(found, key=lambda w: (w not in close, self.distance(v, w), w))[:8]

    def first_weights(self, v, near):
        """Eight, binary32."""
        n = len(near)
        if n == 0:
            return np.zeros(8, f32)
        total = 0.0
        for w in near:
            total += math.sqrt(self.distance(v, w))
        mean = total / n
        spread = 32 * (mean * mean) + 1e-60

        def likeness(q):
            x = 1 + q / spread
            return 1 / (x * x)

        a = [[10.0 + 1.0 + 0.005 if i == j else 10 + likeness(self.distance(near[i], near[j])) for j in range(n)]
             for i in range(n)]
        b = [10 + likeness(self.distance(v, w)) for w in near]
        for k in range(n):
            for i in range(k + 1, n):
                f = a[i][k] / a[k][k]
                for j in range(k + 1, n):
                    a[i][j] -= f * a[k][j]
                b[i] -= f * b[k]
        weights, total = [0.0] * n, 0.0
        for i in range(n - 1, -1, -1):
            x = b[i]
            for j in range(i + 1, n):
                x -= a[i][j] * weights[j]
            weights[i] = x / a[i][i]
            total += weights[i]
        if 0.1 < total < 10:
            weights = [x / total for x in weights]
        else:
            weights = [1 / n] * n
        return np.array(weights + [0.0] * (8 - n)).astype(f32)


# Prediction of motion, in binary32


def sum_of(terms):
    total, *others = terms
    for term in others:
        total = total + term
    return total


class Motion:
    """What the vertices keep from frame to frame, by place."""

    def __init__(self, near, first_weights, steps):
        n = len(near)
        self.near = near  # places
        self.x = limited_points(steps)
        self.o = np.clip(steps - self.x, -0.5, 0.5).astype(f32)
        self.R, self.older = np.zeros((n, 3), f32), np.zeros((n, 3), f32)
        self.e, self.t = np.ones((n, 3), f32), np.zeros((n, 3), f32)
        self.omega = first_weights
        self.w = np.concatenate([first_weights, np.zeros((n, 1), f32)], 1)
        self.D, self.A = np.zeros((n, 3), f32), np.zeros((n, 3), f32)
        self.M, self.N = np.zeros((n, 8, 8), f32), np.zeros((n, 8), f32)

    def around(self, values, k):
        """Of the eight neighbours, 0 of missing ones."""
        found = [values[place] for place in self.near[k]]
        return found + [np.zeros(3, f32)] * (8 - len(found))

    def predict(self, k):
        D, w, R = self.around(self.D, k), self.w[k], self.R[k]
        a = sum_of(self.around(self.A, k))
        everything = (a[0] + a[1] + a[2]) * (f32(0.3) / f32(24))
        m = sum_of([R * w[8]] + [D[i] * w[i] for i in range(8)])
        place = np.clip(self.o[k] + m, f32(-2**23), f32(2**23))
        up = np.floor(place + f32(0.5))
        self.fraction = place - up
        self.whole = [int32(int(x) + int(u)) for x, u in zip(self.x[k], up)]
        self.s = ((a * (f32(0.25) / f32(8)) + np.abs(R) * f32(0.1)) + self.e[k] * f32(0.35)) + everything
        z = self.s * (f32(1) / f32(0.03))
        exponents = ((z * z) * f32(1.41421356)).view(np.uint32) >> 23
        classes = [min(max(int(e) - 127, 0), 23) for e in exponents]
        parts = [min(3, int(part)) for part in np.abs(self.fraction) * f32(8)]
        return [4 * c + part for c, part in zip(classes, parts)]

    def update(self, k, point):
        """With the lattice point that has become known, after predict."""
        x = [int(c) for c in self.x[k]]
        missed = np.array([int32(c - w) for c, w in zip(point, self.whole)]).astype(f32)
        moved = np.array([int32(c - w) for c, w in zip(point, x)]).astype(f32)
        r = missed - self.fraction
        g = np.minimum(f32(0.3) + self.s * f32(0.5), f32(1))
        offset = (f32(1) - g) * np.clip(-r, f32(-0.5), f32(0.5))
        self.t[k] = moved - self.o[k]
        self.D[k], self.A[k] = self.t[k] + offset, np.abs(r)
        self.older[k], self.R[k] = self.R[k], r
        self.e[k] = self.e[k] + f32(0.2) * (np.abs(r) - self.e[k])
        self.x[k], self.o[k] = point, offset

    def learn(self, f):
        """All vertices at once."""
        count = len(self.near)
        D = np.array([self.around(self.D, k) for k in range(count)])
        q = [D[:, i + 1] - D[:, 0] for i in range(7)] + [self.older]
        T = self.t
        for i in range(8):
            T = T - self.omega[:, i, None] * D[:, i]

        def scalar(a, b):
            p = a * b
            return p[:, 0] + p[:, 1] + p[:, 2]

        for i in range(8):
            for j in range(i + 1):
                self.M[:, i, j] = self.M[:, i, j] * f32(0.99) + scalar(q[i], q[j])
            self.N[:, i] = self.N[:, i] * f32(0.99) + scalar(q[i], T)
        due = np.array([f < 8 or (f + k // 8) % 2 == 0 for k in range(count)])
        self.w[due] = self.solve()[due]

    def solve(self):
        M, L, v = self.M, np.zeros_like(self.M), [None] * 8
        for i in range(8):
            u = [None] * 8
            for j in range(i + 1):
                u[j] = M[:, i, j] + f32(8) if i == j else M[:, i, j]
                for k in range(j):
                    u[j] = u[j] - u[k] * L[:, j, k]
                if j < i:
                    L[:, i, j] = u[j] * v[j]
            large = u[i] > (M[:, i, i] + f32(8)) * f32(0.00001)
            v[i] = np.where(large, f32(1) / np.where(large, u[i], f32(1)), f32(0))
        y, x = [None] * 8, [None] * 8
        for i in range(8):
            y[i] = self.N[:, i]
            for j in range(i):
                y[i] = y[i] - L[:, i, j] * y[j]
        for i in range(7, -1, -1):
            x[i] = y[i] * v[i]
            for j in range(i + 1, 8):
                x[i] = x[i] - L[:, j, i] * x[j]
        x = np.array(x)
        x[:, ~np.all(np.abs(x) < 16, axis=0)] = 0
        w = np.zeros_like(self.w)
        w[:, 0] = self.omega[:, 0] - sum_of(x[:7])
        for i in range(1, 8):
            w[:, i] = self.omega[:, i] + x[i - 1]
        w[:, 8] = x[7]
        return w


def limited_points(steps):
    return np.clip(np.floor(steps + 0.5), -LARGEST_POINT, LARGEST_POINT).astype(np.int64)


# Frames after the first


class Stage:
    """Places with a stream of their own."""

    def __init__(self, places, data, checksum):
        self.places, self.stream, self.checksum = places, Stream(data), checksum
        priors = [0.03 * (2.0**(c // 2) * (1.4142135623730951 if c % 2 else 1.0)) for c in range(24)]
        self.models = [Model(priors[i // 4]) for i in range(96)]
        self.exact, self.points = Model(), []

    def finish(self):
        self.stream.finish()
        data = b"".join(struct.pack("<4i", *point, 0) for point in self.points)
        need(crc32c(data) == self.checksum, "other lattice points than the encoder's")


def decode_fitted(reader, triangles, first, frame_count, center):
    """Positions [F,V,3], float32."""
    delta = reader.get("d")
    need(0 <= delta < math.inf, "spacing")
    count = len(first)
    groups = (count + 7) // 8
    stage_count = min(max(count * frame_count // 262144, 1), min(4, groups))
    table = [(reader.get("I"), reader.varint(reader.left())) for _ in range(stage_count)]
    starts = [min(8 * (groups * s // stage_count), count) for s in range(stage_count + 1)]
    stages = [Stage(range(starts[s], starts[s + 1]), reader.take(size), checksum)
              for s, (checksum, size) in enumerate(table)]

    def in_steps(position):
        if delta == 0:
            return np.zeros(position.shape)
        return (position.astype(np.float64) - center) * (1 / delta)

    places = Places(triangles, first)
    near = [places.neighbours(v) for v in places.order]
    weights = np.array([places.first_weights(v, ends) for v, ends in zip(places.order, near)])
    motion = Motion([[places.place[w] for w in ends] for ends in near], weights, in_steps(first[places.order]))
    positions = np.zeros((frame_count, count, 3), np.float32)
    positions[0] = first
    for f in range(1, frame_count):
        for stage in stages:
            for k in stage.places:
                contexts = motion.predict(k)
                value = stage.stream.value(stage.models[contexts[0]])
                if value == -2**31:
                    exact = np.array([stage.stream.value(stage.exact) for _ in range(3)], np.int32).view(np.float32)
                    need(np.isfinite(exact).all(), "a vertex that is not finite")
                    point = [int(c) for c in limited_points(in_steps(exact))]
                else:
                    r = [value] + [stage.stream.value(stage.models[c]) for c in contexts[1:]]
                    point = [int32(whole - s if fraction < 0 else whole + s)
                             for whole, s, fraction in zip(motion.whole, r, motion.fraction)]
                    point = [min(max(c, -LARGEST_POINT), LARGEST_POINT) for c in point]
                    exact = (center + np.array(point, np.float64) * delta).astype(np.float32)
                motion.update(k, point)
                stage.points.append(point)
                positions[f, places.order[k]] = exact
        motion.learn(f)
    for stage in stages:
        stage.finish()
    return positions


def decode_split(sections, triangles, vertex_count, frame_count):
    """Positions [F,V,3], float32."""
    reader = Reader(sections[1])
    predictor, bending = reader.get("B"), reader.get("B")
    center, bound = np.array([reader.get("f") for _ in range(3)], np.float64), reader.get("d")
    need(predictor in (4, 5, *range(11, 19)) and bending <= 2, "an unknown predictor")
    need(np.isfinite(center).all() and 0 <= bound < math.inf and reader.left() == 0, "parameters")
    need(all(0 <= v < vertex_count for t in triangles for v in t), "triangles of another clip")
    triangles = [tuple(map(int, t)) for t in triangles]
    reader = Reader(sections[6])
    method, count, first_count, first_sections = parse_clip(reader.take(reader.varint(reader.left())))
    need((method, count, first_count) == (1, vertex_count, 1), "no first frame of this clip")
    positions = decode_static(first_sections, triangles, vertex_count, 1)
    if frame_count > 1 and predictor == 5:
        positions = decode_fitted(reader, triangles, positions[0], frame_count, center)
    elif frame_count > 1:
        rest = reader.take(reader.left())
        positions = decode_gates(rest, triangles, predictor, bending, center, bound, positions[0], frame_count)
    need(reader.left() == 0, "bytes left over")
    return positions
