"""The splitcoder's frames at gates, of docs/FORMAT.md; a part of independent_decoder.py."""

import math
import struct

import numpy as np

from independent_bending import Bending, direction, unit_vector
from independent_static import class_of, integer_means, scale_model, traverse_mesh
from independent_streams import Model, Reader, Stream, crc32c, need
from independent_surface_gluing import Surface
from independent_vectors import cross, dot, length, minus, plus, times

LARGEST = 2**23
LIMIT = 2**29


def limited(value):
    return (value if value < LIMIT else LIMIT) if value > -LIMIT else -LIMIT


class GateFrames:
    """What is kept of the frame being decoded and of the one before."""

    def __init__(self, triangles, vertex_count, predictor, normal):
        self.order = traverse_mesh(triangles, vertex_count)
        self.predictor, self.normal = predictor, normal
        self.circles = 11 <= predictor <= 15
        self.now, self.before = [[0.0] * 3] * vertex_count, [[0.0] * 3] * vertex_count
        self.sizes, self.means = [[0] * 3] * vertex_count, [[0] * 3] * vertex_count
        self.memory, self.decoded = {}, set()
        surface = Surface(triangles) if self.circles and normal > 0 else None
        self.bending = Bending(surface, 6, (0, 0.0, 0.0), self.now.__getitem__, self.decoded.__contains__) \
            if surface else None

    def moved(self, v):
        return minus(self.now[v], self.before[v])

    def system(self, gate):
        left, right, opposite = (self.now[w] for w in gate[:3])
        e, origin = minus(right, left), times(0.5, plus(left, right))
        a = minus(origin, opposite)
        if not dot(e, e) > 0:
            return None
        x = times(1.0 / length(e), e)
        b = minus(a, times(dot(a, x), x))
        height = length(b)
        if not height > (32.0 if self.circles else 1.0):
            return None
        y = times(1.0 / height, b)
        return origin, x, y, cross(x, y)

    def remember(self, v, gates):
        for g in gates[:1] if self.circles else gates if self.predictor == 4 else []:
            system = self.system(g)
            if system:
                q = minus(self.now[v], system[0])
                self.memory[v, g] = [dot(q, axis) for axis in system[1:]]

    def moved_by(self, v, gates):
        total = [0.0] * 3
        for left, right, opposite, _ in gates:
            total = plus(total, minus(plus(self.moved(left), self.moved(right)), self.moved(opposite)))
        return plus(self.before[v], times(1.0 / len(gates), total))

    def replica(self, v, gates):
        left, right, opposite = gates[0][:3]

        def edges(p):
            a, b = minus(p[right], p[left]), minus(p[opposite], p[left])
            n = cross(a, b)
            return a, b, n, dot(n, n)

        a, b, n, area = edges(self.before)
        new_a, new_b, new_n, new_area = edges(self.now)
        if not (area > 0.001 * (dot(a, a) * dot(b, b)) and new_area > 0.001 * (dot(new_a, new_a) * dot(new_b, new_b))):
            return self.moved_by(v, gates)
        d = minus(self.before[v], self.before[left])
        s = (dot(d, a) * dot(b, b) - dot(d, b) * dot(a, b)) / area
        t = (dot(d, b) * dot(a, a) - dot(d, a) * dot(a, b)) / area
        u = dot(d, n) / area * math.sqrt(math.sqrt(area / new_area))
        return plus(self.now[left], plus(plus(times(s, new_a), times(t, new_b)), times(u, new_n)))

    def local_multiway(self, v, gates):
        total, count = [0.0] * 3, 0
        for g in gates:
            system, m = self.system(g), self.memory.get((v, g))
            if system and m:
                o, x, y, z = system
                total = [total[c] + (((o[c] + x[c] * m[0]) + y[c] * m[1]) + z[c] * m[2]) for c in range(3)]
                count += 1
        return times(1.0 / count, total) if count else self.moved_by(v, gates)

    def circle(self, v, gates, system):
        m = self.memory.get((v, gates[0]))
        rho = math.sqrt(m[1] * m[1] + m[2] * m[2]) if m else 0.0
        if self.predictor == 11 and m:
            along, away = m[0], rho
        else:
            used = gates if self.predictor in (13, 15) else gates[:1]
            q = [0.0] * 3
            for left, right, opposite, _ in used:
                q = plus(q, minus(plus(self.now[left], self.now[right]), self.now[opposite]))
            q = minus(times(1.0 / len(used), q), system[0])
            up, out = dot(q, system[2]), dot(q, system[3])
            along, away = dot(q, system[1]), math.sqrt(up * up + out * out)
            if self.predictor in (14, 15) and m:
                along, away = 0.5 * (along + m[0]), 0.5 * (away + rho)
        past = direction(m[1], m[2]) if m else None
        bend = (1.0, 0.0)
        if self.normal == 0:
            bend = past or bend
        else:
            bend = self.bending.creases(gates[0][3], system)
            if self.normal == 2 and past:
                bend = direction(bend[0] + past[0], bend[1] + past[1]) or bend
        return along, away, bend

    def predict(self, v, gates, bare):
        """Which axes (0 world, 1 local, 2 circle), the local system, and a place or (t0, t1, (C, S))."""
        if not gates and bare is None:
            return 0, None, self.before[v]
        if not gates:
            return 0, None, plus(self.before[v], times(0.5, plus(self.moved(bare[0]), self.moved(bare[1]))))
        system = self.system(gates[0])
        if self.circles and system:
            return 2, system, self.circle(v, gates, system)
        if self.predictor == 4:
            place = self.local_multiway(v, gates)
        elif self.predictor == 18:
            place = self.replica(v, gates)
        else:
            place = self.moved_by(v, gates[:1] if self.predictor == 16 else gates)
        return (1 if system else 0), system, place

    def expected(self, v, gates, bare):
        if not gates and bare is None:
            return list(self.means[v])
        near = list(bare) if not gates else [w for g in gates[:2] for w in g[:2]]
        if len(gates) == 1:
            near.append(gates[0][2])
        means = integer_means([self.sizes[w] for w in near])
        return [(7 * n + 9 * m) // 16 for n, m in zip(means, self.means[v])]


def lead(axes, system, prediction, r):
    steps = [64.0 * value for value in r]
    if axes == 0:
        return plus(prediction, steps)
    start = prediction
    if axes == 2:
        along, away, (bend_cosine, bend_sine) = prediction
        start = system[0]
        radius = max(away + steps[1], 0.0)
        cosine, sine = unit_vector(min(max(steps[2] / max(32.0, radius), -4.0), 4.0))
        steps = [along + steps[0], radius * (bend_cosine * cosine - bend_sine * sine),
                 radius * (bend_cosine * sine + bend_sine * cosine)]
    _, x, y, z = system
    return [((start[c] + x[c] * steps[0]) + y[c] * steps[1]) + z[c] * steps[2] for c in range(3)]


def decode_gates(data, triangles, predictor, normal, center, bound, first, frame_count):
    """Positions [F,V,3], float32. first: those of the first frame, [V,3]."""
    vertex_count = len(first)
    reader = Reader(data)
    step, checksum = reader.get("B"), reader.get("I")
    need(16 <= step <= 128, "a step out of range")
    stream = Stream(reader.take(reader.left()))
    spacing = bound * (step / 64.0) / 64
    per_unit = 1.0 / spacing if spacing > 0 else 0.0
    per_unit = per_unit if math.isfinite(per_unit) else 0.0
    center = [float(c) for c in center]

    def point_of(world):
        return [int(limited(math.floor((float(p) - c) * per_unit + 0.5))) for p, c in zip(world, center)]

    state = GateFrames([tuple(map(int, t)) for t in triangles], vertex_count, predictor, normal)
    models, exact = [[{}, {}] for _ in range(3)], Model()
    frames, packed = [np.asarray(first, np.float32)], []
    for v, gates, _, _ in state.order:
        state.now[v] = [float(c) for c in point_of(first[v])]
        state.remember(v, gates)

    def size_of(value):
        return min(16 * abs(value), LARGEST)

    for _ in range(1, frame_count):
        state.before[:] = state.now
        state.decoded.clear()
        positions = np.zeros((vertex_count, 3), np.float32)
        for v, gates, bare, _ in state.order:
            axes, system, prediction = state.predict(v, gates, bare)
            s = state.expected(v, gates, bare)
            t = (s[0] + s[1]) // 2
            r = [stream.value(scale_model(models[axes][0], class_of(min(t, LARGEST)))), 0, 0]
            if r[0] == -2**31:
                world = np.array([stream.value(exact) for _ in range(3)], np.int32).view(np.float32)
                need(np.isfinite(world).all(), "a vertex that is not finite")
                r, point = [0, 0, 0], point_of(world)
            else:
                size = (13 * t + 3 * size_of(r[0])) // 16
                r[1] = stream.value(scale_model(models[axes][0], class_of(min(size, LARGEST))))
                size = (12 * s[2] + 2 * (size_of(r[0]) + size_of(r[1]))) // 16
                r[2] = stream.value(scale_model(models[axes][1], class_of(min(size, LARGEST))))
                point = [math.floor(limited(y) + 0.5) for y in lead(axes, system, prediction, r)]
                world = np.array([c + k * spacing for c, k in zip(center, point)], np.float64).astype(np.float32)
            positions[v] = world
            state.now[v] = [float(c) for c in point]
            state.decoded.add(v)
            state.remember(v, gates)
            state.sizes[v] = [size_of(value) for value in r]
            state.means[v] = [m + ((size - m + 2) >> 2) for m, size in zip(state.means[v], state.sizes[v])]
            packed.append(struct.pack("<3i", *point))
        frames.append(positions)
    stream.finish()
    need(crc32c(b"".join(packed)) == checksum, "other lattice points than the encoder's")
    return np.array(frames)
