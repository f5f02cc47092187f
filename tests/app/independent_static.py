"""The static coder of docs/FORMAT.md; a part of independent_decoder.py."""

import math
import struct
from collections import deque

import numpy as np

from independent_bending import Bending, unit_vector
from independent_streams import Model, Reader, Stream, crc32c, need
from independent_surface_gluing import Surface
from independent_vectors import cross, dot, length, minus, plus, times

LARGEST = 2**23


def other_corners(t, v):
    k = list(t).index(v)
    left, right = t[(k + 1) % 3], t[(k + 2) % 3]
    return (left, right) if len({v, left, right}) == 3 else None


def traverse_mesh(triangles, vertex_count):
    """Vertices in order, each with its gates (left, right, opposite, number of the reference triangle), bare edge and
    anchor."""
    incident = [[] for _ in range(vertex_count)]
    for number, t in enumerate(triangles):
        for v in t:
            incident[v].append(number)
    visited, ready = [False] * vertex_count, [0] * vertex_count
    queues, order = [deque() for _ in range(3)], []

    def across(left, right, v):
        for number in incident[left]:
            ends = other_corners(triangles[number], left)
            if ends and right in ends:
                third = ends[0] if ends[1] == right else ends[1]
                if third != v and visited[third]:
                    return left, right, third, number
        return None

    def visit(v, anchor):
        gates, bare = [], None
        for number in incident[v]:
            ends = other_corners(triangles[number], v)
            if not ends or not (visited[ends[0]] and visited[ends[1]]):
                continue
            gate = across(*ends, v)
            if gate is None:
                bare = ends
            else:
                gates.append(gate)
                if len(gates) == 4:
                    break
        visited[v] = True
        order.append((v, gates, bare if not gates else None, anchor))
        for number in incident[v]:
            missing = [w for w in triangles[number] if not visited[w]]
            if len(missing) == 1 and ready[missing[0]] < 3:
                queues[ready[missing[0]]].append(missing[0])
                ready[missing[0]] += 1

    def last():
        return order[-1][0] if order else None

    for t in triangles:
        anchor = last()
        for v in t:
            if not visited[v]:
                visit(v, anchor)
            anchor = v
        while True:
            for queue in reversed(queues):
                while queue and visited[queue[0]]:
                    queue.popleft()
            queue = next((q for q in reversed(queues) if q), None)
            if queue is None:
                break
            visit(queue.popleft(), last())
    for v in range(vertex_count):
        if not visited[v]:
            visit(v, last())
    return order


def class_of(size):
    k = (size * size * 92682) >> 16
    return min(k.bit_length() - 1, 55) if k else 0


def scale_model(models, c):
    if c not in models:
        models[c] = Model(2.0**(c // 2 - 4) * (1.4142135623730951 if c % 2 else 1.0))
    return models[c]


def integer_means(lists):
    return [sum(values) // len(values) for values in zip(*lists)]


def find_cotangents(surface):
    """Of each vertex that is the corner of a triangle."""
    cotangents = {}
    for h, fan in enumerate(surface.fan):
        size = max(3, surface.fan_size[fan] * (2 if surface.fan_is_open[fan] else 1))
        c, s = unit_vector(6.28318530717958647692 / size)
        cotangents[surface.start(h)] = float(np.float32(c / s))
    return cotangents


class Circle:
    """Residuals along a gate, away from it and around it; none where the gate is degenerate."""

    def __init__(self, gate, at):
        left, right, opposite = map(at, gate[:3])
        self.gate, self.is_there = gate, False
        self.middle = times(0.5, plus(left, right))
        e = minus(right, left)
        self.length = length(e)
        if not self.length > 0:
            return
        self.x = times(1.0 / self.length, e)
        a = minus(self.middle, opposite)
        b = minus(a, times(dot(a, self.x), self.x))
        h = length(b)
        if not h > 1e-3:
            return
        self.y = times(1.0 / h, b)
        self.z = cross(self.x, self.y)
        self.is_there = True

    def lead(self, place, r, bending):
        """Where residuals lead from a predicted place."""
        d = minus(place, self.middle)
        up, out = dot(d, self.y), dot(d, self.z)
        f = dot(d, self.x) + r[0] * 16.0
        radius = max(1.0, math.sqrt(up * up + out * out) + r[1] * 16.0)
        frame = (self.middle, self.x, self.y, self.z, self.length)
        bend_cosine, bend_sine = bending.angle(self.gate, frame, f, radius)
        cosine, sine = unit_vector(min(max(r[2] * 16.0 / radius, -4.0), 4.0))
        along = radius * (bend_cosine * cosine - bend_sine * sine)
        above = radius * (bend_cosine * sine + bend_sine * cosine)
        return [((self.middle[k] + self.x[k] * f) + self.y[k] * along) + self.z[k] * above for k in range(3)]


def decode_frame(data, order, find_surface, bits, center, e_max):
    """Positions [V,3] of one frame, float32."""
    reader = Reader(data)
    predictor, variant = reader.get("B"), reader.get("B")
    circles = 6 <= predictor <= 9
    need(1 <= predictor <= 10 and variant <= (3 if circles else 16), "an unknown predictor")
    fit_to = None
    if predictor in (7, 8, 9):
        fit_to = reader.get("B"), reader.get("f"), reader.get("f")
        need(3 <= fit_to[0] <= 64 and 0 <= fit_to[1] <= 8 and 0 <= fit_to[2] <= 1, "a fit out of range")
    elif predictor == 6:
        fit_to = 0, 0.0, 0.0
    curvature = 0 if circles else variant
    takes_one = variant == 0 if circles else predictor in (1, 3)
    weighs = variant == 3 if circles else predictor == 10
    corrects = variant >= 2 if circles else predictor == 5
    has_axes = predictor in (3, 4, 5, 10)
    checksum = reader.get("I")
    stream = Stream(reader.take(reader.left()))
    spacing = e_max / 2.0**bits / 16
    count = len(order)
    points, sizes, bends = [[0, 0, 0]] * count, [[0, 0, 0]] * count, [0.0] * count
    positions = np.zeros((count, 3), np.float32)
    lone, fits = [1600] * 3, [[0.0] * 5 for _ in range(4)]
    models, exact = [[{}, {}], [{}, {}]], Model()

    def at(v):
        return [float(c) for c in points[v]]

    cotangents = find_cotangents(find_surface()) if weighs else None
    decoded = set()
    bending = Bending(find_surface(), predictor, fit_to, at, decoded.__contains__) if circles else None

    def lead(left, right, opposite):
        if not weighs:
            return minus(plus(at(left), at(right)), at(opposite))
        l, r = cotangents[left], cotangents[right]
        p = min(max(l / (l + r), 0.0), 1.0) if l + r > 0.1 else 0.5
        return minus(plus(times(2.0 * (1.0 - p), at(left)), times(2.0 * p, at(right))), at(opposite))

    for v, gates, bare, anchor in order:
        x, axes, bend, fit = [0.0] * 3, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 0.0, None
        circle = None
        if takes_one:
            gates = gates[:1]
        n = len(gates)
        if n:
            for gate in gates:
                x = plus(x, lead(*gate[:3]))
            x = times(1.0 / n, x)
            expected = integer_means([sizes[w] for gate in gates[:2] for w in gate[:2]] +
                                     ([sizes[gates[0][2]]] if n == 1 else []))
        elif bare:
            x = times(0.5, plus(at(bare[0]), at(bare[1])))
            expected = [min(3 * s + 80, LARGEST) for s in integer_means([sizes[w] for w in bare])]
        else:
            x = at(anchor) if anchor is not None else x
            expected = list(lone)

        if n and corrects:
            plain, side = x, [0.0] * 3
            shared = set(gates[0][:2]) & set(gates[1][:2]) if n == 2 else ()
            if len(shared) == 1:
                c = shared.pop()
                a, b = (next(w for w in gate[:2] if w != c) for gate in gates)
                twice = times(2.0, at(c))
                u = minus(plus(at(a), at(b)), twice)
                side = minus(plus(at(gates[0][2]), at(gates[1][2])), twice)
                fit = fits[3]
            else:
                ring = [0.0] * 3
                for left, right, *_ in gates:
                    ring = plus(ring, plus(at(left), at(right)))
                ring = times(0.5 / n, ring)
                u, fit = minus(ring, x), fits[min(n, 3) - 1]
                along = minus(at(gates[0][1]), at(gates[0][0]))
                if n == 1 and dot(along, along) > 0:
                    side = times(dot(minus(at(gates[0][2]), ring), along) / dot(along, along), along)
            uu, uv, vv, ut, vt = fit
            a, b = 1.001 * uu + 1e-6, 1.001 * vv + 1e-6
            d = a * b - uv * uv
            x = plus(x, plus(times((ut * b - vt * uv) / d, u), times((vt * a - ut * uv) / d, side)))

        if n and has_axes:
            normal = [0.0] * 3
            for left, right, opposite, _ in gates:
                normal = plus(normal, cross(minus(at(right), at(left)), minus(at(left), at(opposite))))
            size = length(normal)
            if size > 0:
                z = times(1.0 / size, normal)
                w = minus(at(gates[0][1]), at(gates[0][0]))
                w = minus(w, times(dot(w, z), z))
                size = length(w)
                if size > 1e-3:
                    w = times(1.0 / size, w)
                    axes = [w, cross(z, w), z]
            total = 0.0
            for left, right, *_ in gates:
                total += bends[left]
                total += bends[right]
            bend = total * curvature / (32.0 * n)
            x = [a + bend * 16 * b for a, b in zip(x, axes[2])]
        if n and circles:
            circle = Circle(gates[0], at)

        r = [0, 0, 0]
        pair = models[n > 1]
        tangential = (expected[0] + expected[1]) // 2

        def size_of(value):
            return min(16 * abs(value), LARGEST)

        r[0] = stream.value(scale_model(pair[0], class_of(tangential)))
        if r[0] == -2**31:
            world = np.array([stream.value(exact) for _ in range(3)], np.int32).view(np.float32)
            need(np.isfinite(world).all(), "a vertex that is not finite")
            point = [math.floor((float(p) - c) / spacing + 0.5) if spacing > 0 else 0 for p, c in zip(world, center)]
            point = [max(-2**29, min(2**29, c)) for c in point]
            r = [0, 0, 0]
        else:
            r[1] = stream.value(scale_model(pair[0], class_of(min((7 * tangential + 3 * size_of(r[0])) // 10, LARGEST))))
            r[2] = stream.value(scale_model(pair[1], class_of(
                min((8 * expected[2] + size_of(r[0]) + size_of(r[1])) // 10, LARGEST))))
            if circle and circle.is_there:
                place = circle.lead(x, r, bending)
            else:
                place = [((x[c] + axes[0][c] * r[0] * 16) + axes[1][c] * r[1] * 16) + axes[2][c] * r[2] * 16
                         for c in range(3)]
            point = []
            for y in place:
                y = (y if y < 2.0**29 else 2.0**29) if y > -2.0**29 else -2.0**29
                point.append(math.floor(y + 0.5))
            world = np.array([c + k * spacing for c, k in zip(center, point)], np.float64).astype(np.float32)
        points[v], positions[v] = point, world
        decoded.add(v)
        sizes[v] = [size_of(value) for value in r]
        if n:
            bends[v] = float(np.float32(r[2] + bend))
        elif not bare:
            lone = [s + int((size - s) / 8) for s, size in zip(lone, sizes[v])]
        if fit is not None:
            missed = minus(at(v), plain)
            weight = 1.0 / (dot(u, u) + dot(side, side) + 1.0)
            products = (dot(u, u), dot(u, side), dot(side, side), dot(u, missed), dot(side, missed))
            fit[:] = [0.998 * old + weight * new for old, new in zip(fit, products)]
    stream.finish()
    need(crc32c(struct.pack(f"<{3 * count}i", *(c for point in points for c in point))) == checksum,
         "other lattice points than the encoder's")
    return positions


def decode_static(sections, triangles, vertex_count, frame_count):
    """Positions [F,V,3], float32."""
    reader = Reader(sections[1])
    bits, center, e_max = reader.get("B"), [reader.get("f") for _ in range(3)], reader.get("f")
    need(4 <= bits <= 24 and np.isfinite(center).all() and 0 <= e_max < math.inf, "parameters")
    need(reader.left() == 0, "bytes left over")
    need(all(0 <= v < vertex_count for t in triangles for v in t), "triangles of another clip")
    triangles = [tuple(map(int, t)) for t in triangles]
    order = traverse_mesh(triangles, vertex_count)
    surfaces = []

    def find_surface():
        if not surfaces:
            surfaces.append(Surface(triangles))
        return surfaces[0]

    reader = Reader(sections[6])
    sizes = [reader.varint(len(sections[6])) for _ in range(frame_count)]
    frames = [decode_frame(reader.take(size), order, find_surface, bits, center, e_max) for size in sizes]
    need(reader.left() == 0, "bytes left over")
    return np.array(frames)
