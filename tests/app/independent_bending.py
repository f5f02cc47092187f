"""Bending angles of the static coder in docs/FORMAT.md, and the elementary functions that it needs; a part of
independent_decoder.py."""

import math
import struct

from independent_surface_gluing import following, preceding
from independent_vectors import cross, dot, length, minus, times

# Elementary functions

PI = 3.14159265358979323846
LN2 = 0.69314718055994530942


def unit_vector(angle):
    a = angle / 16.0
    q = a * a
    s = a * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0))))
    v = q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0)))
    for _ in range(4):
        c = 1.0 - v
        v, s = 2.0 * s * s, 2.0 * s * c
    return 1.0 - v, s


def angle_of(x, y):
    small, large = sorted((abs(x), abs(y)))
    if not large > 0.0:
        return 0.0
    t = small / large
    for _ in range(2):
        t = t / (1.0 + math.sqrt(1.0 + t * t))
    q = t * t
    angle = 4.0 * t * (1.0 - q * (1.0 / 3 - q * (1.0 / 5 - q * (1.0 / 7 - q * (1.0 / 9 - q * (1.0 / 11 - q / 13.0))))))
    if abs(x) < abs(y):
        angle = PI / 2.0 - angle
    if x < 0.0:
        angle = PI - angle
    return -angle if y < 0.0 else angle


def power(base, exponent):
    bits = struct.unpack("<Q", struct.pack("<d", base))[0]
    octave = (bits >> 52) - 1023
    m = struct.unpack("<d", struct.pack("<Q", bits % 2**52 + (1023 << 52)))[0]
    t = (m - 1.4142135623730951) / (m + 1.4142135623730951)
    q = t * t
    series = 1.0 + q * (1.0 / 3 + q * (1.0 / 5 + q * (1.0 / 7 + q * (1.0 / 9 + q / 11.0))))
    wanted = ((octave + 0.5) + 2.0 / LN2 * t * series) * exponent
    wanted = min(max(wanted, -1000.0), 1000.0)
    whole = int(wanted - 0.5 if wanted < 0.0 else wanted + 0.5)
    x = (wanted - whole) * LN2
    rest = 1.0
    for k in (8, 7, 6, 5, 4, 3, 2):
        rest = 1.0 + x / k * rest
    return (1.0 + x * rest) * math.ldexp(1.0, whole)


def cube_root(x):
    if x == 0.0:
        return 0.0
    s = abs(x)
    r = power(s, 1.0 / 3.0)
    r = r - (r * r * r - s) / (3.0 * r * r)
    return -r if x < 0.0 else r


def quadratic(a, b, c):
    if a == 0.0:
        return [] if b == 0.0 else [-c / b]
    delta = b * b - 4.0 * a * c
    if not delta >= 0.0:
        return []
    root = math.sqrt(delta)
    q = -0.5 * (b - root if b < 0.0 else b + root)
    return [q / a] if q == 0.0 else [q / a, c / q]


def cubic(a, b, c):
    h = a / 3.0
    p = (b - a * h) / 3.0
    q = (2.0 * h * h * h - b * h + c) / 2.0
    delta = q * q + p * p * p
    if delta >= 0.0:
        root = math.sqrt(delta)
        u = cube_root(-q - root if q > 0.0 else -q + root)
        return [(0.0 if u == 0.0 else u - p / u) - h]
    angle = angle_of(-q, math.sqrt(-delta)) / 3.0
    return [2.0 * math.sqrt(-p) * unit_vector(angle - 2.0 * PI / 3.0 * k)[0] - h for k in range(3)]


def mend(coefficients, t):
    c0, c1, c2, c3, c4 = coefficients
    for _ in range(2):
        value = (((c4 * t + c3) * t + c2) * t + c1) * t + c0
        slope = ((4.0 * c4 * t + 3.0 * c3) * t + 2.0 * c2) * t + c1
        if not slope * slope > 1e-24:
            break
        t = t - value / slope
    return t


def real_roots(coefficients):
    c0, c1, c2, c3, c4 = coefficients
    largest = max(map(abs, coefficients))
    if not 0.0 < largest < 1e100:
        return []
    limit = 1e-7 * largest
    if not abs(c4) < limit:
        a, b, d, e = c3 / c4, c2 / c4, c1 / c4, c0 / c4
        h = a / 4.0
        k = h * h
        p = b - 6.0 * k
        q = d - 2.0 * b * h + 8.0 * k * h
        r = e - d * h + b * k - 3.0 * k * k
        z = cubic(2.0 * p, p * p - 4.0 * r, -q * q)[0]
        if z > 0.0:
            s = math.sqrt(z)
            m, n = 0.5 * (p + z), 0.5 * q / s
            roots = quadratic(1.0, s, m - n) + quadratic(1.0, -s, m + n)
        else:
            roots = [root for w in quadratic(1.0, p, r) if w >= 0.0 for root in (math.sqrt(w), -math.sqrt(w))]
        roots = [root - h for root in roots]
    elif not abs(c3) < limit:
        roots = cubic(c2 / c3, c1 / c3, c0 / c3)
    else:
        roots = quadratic(c2, c1, c0)
    return [mend(coefficients, root) for root in roots]


# Fits


class NothingFound(Exception):
    pass


class Factored:
    """The matrix m, of which the lower triangle counts, with a ridge."""

    def __init__(self, m, ridge):
        self.f, self.d = [], []
        for j, given in enumerate(m):
            row = []
            for k in range(j + 1):
                s = given[k] + ridge if k == j else given[k]
                other = self.f[k] if k < j else row
                for a, b in zip(row, other[:k]):
                    s -= a * b
                if k < j:
                    row.append(s * self.d[k])
                elif not s > 0.0:
                    raise NothingFound
                else:
                    self.d.append(1.0 / math.sqrt(s))
            self.f.append(row)

    def solve(self, b):
        b, size = list(b), len(b)
        for j in range(size):
            for k in range(j):
                b[j] -= self.f[j][k] * b[k]
            b[j] *= self.d[j]
        for j in reversed(range(size)):
            for k in range(j + 1, size):
                b[j] -= self.f[k][j] * b[k]
            b[j] *= self.d[j]
        return b


def add_square(m, w, v):
    for j, row in enumerate(m):
        scaled = w * v[j]
        for k in range(j + 1):
            row[k] += scaled * v[k]


def direction(p, q):
    m = math.sqrt(p * p + q * q)
    return (p / m, q / m) if m > 0.0 else None


class Bending:
    """Bending angles of one frame. at(v): a decoded vertex' lattice point as floats. is_decoded(v)."""

    def __init__(self, surface, predictor, fit, at, is_decoded):
        self.surface, self.predictor, self.at, self.is_decoded = surface, predictor, at, is_decoded
        self.vertices, self.exponent, self.cosine = fit
        self.normals = {}

    def angle(self, gate, frame, f, radius):
        """gate: left, right, opposite, number of the reference triangle. frame: M, X, Y, Z, L."""
        left, right, opposite, triangle = gate
        found = None
        try:
            if self.predictor == 7:
                found = self.graph(self.gather(gate, frame), f, radius)
            elif self.predictor == 8:
                found = self.quadric(self.gather(gate, frame), f, radius)
            elif self.predictor == 9:
                found = self.sphere(opposite, triangle, frame, f, radius)
        except NothingFound:
            pass
        return found or self.creases(triangle, frame)

    def local(self, v, frame):
        p = minus(self.at(v), frame[0])
        return [dot(p, frame[1]), dot(p, frame[2]), dot(p, frame[3])]

    def normal(self, t):
        if t not in self.normals:
            c0, c1, c2 = map(self.at, self.surface.triangles[t])
            n = cross(minus(c1, c0), minus(c2, c0))
            size = length(n)
            self.normals[t] = times(1.0 / size, n) if size > 0.0 else None
        return self.normals[t]

    def decoded_twin(self, h):
        g = self.surface.twin[h]
        return g if g is not None and all(map(self.is_decoded, self.surface.triangles[g // 3])) else None

    def creases(self, triangle, frame):
        cosine, sine = 0.0, 0.0
        for h in range(3 * triangle, 3 * triangle + 3):
            g = self.decoded_twin(h)
            if g is None:
                continue
            start = self.at(self.surface.start(h))
            e = minus(self.at(self.surface.end(h)), start)
            n = dot(e, e)
            if not n > 0.0:
                continue
            i = minus(self.at(self.surface.third(h)), start)
            a = minus(times(dot(i, e) / n, e), i)
            size = length(a)
            if not size > 0.0:
                continue
            o = minus(self.at(self.surface.third(g)), start)
            crease = direction(dot(o, a) / size, dot(o, frame[3]))
            if crease:
                cosine += crease[0]
                sine += crease[1]
        return direction(cosine, sine) or (1.0, 0.0)

    def gather(self, gate, frame):
        taken = list(gate[:3])
        reference = self.normal(gate[3])
        met = {gate[3]}
        queue = [3 * gate[3], 3 * gate[3] + 1, 3 * gate[3] + 2] if reference else []
        j = 0
        while j < len(queue) and j < 4 * self.vertices and len(taken) < self.vertices:
            g = self.surface.twin[queue[j]]
            j += 1
            if g is None or g // 3 in met:
                continue
            met.add(g // 3)
            if not all(map(self.is_decoded, self.surface.triangles[g // 3])):
                continue
            normal = self.normal(g // 3)
            if not normal or not dot(normal, reference) > self.cosine:
                continue
            if self.surface.third(g) not in taken:
                taken.append(self.surface.third(g))
            queue += [following(g), preceding(g)]
        return [self.local(v, frame) for v in taken]

    def weight(self, p):
        square = dot(p, p)
        return power(square, -0.5 * self.exponent) if square > 0.0 else 0.0

    def graph(self, vertices, f, radius):
        if len(vertices) < 4:
            return None
        m, b, total, i = [[0.0] * 6 for _ in range(6)], [0.0] * 6, 0.0, 1.0 / radius
        for vertex in vertices:
            p = times(i, vertex)
            w = self.weight(p)
            terms = [1.0, p[0], p[1], p[0] * p[0], p[0] * p[1], p[1] * p[1]]
            add_square(m, w, terms)
            b = [old + w * p[2] * term for old, term in zip(b, terms)]
            total += w
        b = Factored(m, 1e-4 * total).solve(b)
        g = f * i
        a = b[0] + g * (b[1] + g * b[3])
        slope = b[2] + g * b[4]
        bow = b[5]
        roots = real_roots([a * a - 1.0, 2.0 * a * slope, 1.0 + slope * slope + 2.0 * a * bow, 2.0 * slope * bow,
                            bow * bow])
        if not roots:
            return None
        y = max(roots)
        return direction(y, a + y * (slope + y * bow))

    def quadric(self, vertices, f, radius):
        if len(vertices) < 4:
            return None
        m, total, i = [[0.0] * 10 for _ in range(10)], 0.0, 1.0 / radius
        for vertex in vertices:
            x, y, z = p = times(i, vertex)
            w = self.weight(p)
            add_square(m, w, [1.0, x, y, z, x * x, x * y, y * y, y * z, z * z, z * x])
            total += w
        factored = Factored(m, 1e-7 * total)
        q = [0.0] * 10
        q[3] = 1.0
        for _ in range(3):
            q = factored.solve(q)
            n = 0.0
            for value in q:
                n += value * value
            if not 0.0 < n < 1e200:
                return None
            q = times(1.0 / math.sqrt(n), q)
        g = f * i
        o = q[0] + g * (q[1] + g * q[4])
        cosine, sine = q[2] + g * q[5], q[3] + g * q[9]
        roots = real_roots([o + cosine + q[6], 2.0 * (sine + q[7]), 2.0 * (o - q[6]) + 4.0 * q[8],
                            2.0 * (sine - q[7]), o - cosine + q[6]])
        if not roots:
            return None
        t = min(roots, key=abs)
        return direction(1.0 - t * t, 2.0 * t)

    def sphere(self, opposite, triangle, frame, f, radius):
        q = self.local(opposite, frame)
        half = 0.5 * frame[4]
        reference = self.normal(triangle)
        if not q[1] < 0.0 or not reference:
            return None
        z = (q[0] * q[0] + q[1] * q[1] - half * half) / (2.0 * q[1])
        square = half * half + z * z
        radii, curvatures, count = 0.0, 0.0, 0
        for h in range(3 * triangle, 3 * triangle + 3):
            g = self.decoded_twin(h)
            normal = None if g is None else self.normal(g // 3)
            if not normal or not dot(normal, reference) > self.cosine:
                continue
            q = self.local(self.surface.third(g), frame)
            a = q[1] - z
            p = q[0] * q[0] + a * a + q[2] * q[2] - square
            if not abs(q[2]) > 1e-9 * abs(p):
                continue
            height = p / (2.0 * q[2])
            r = math.sqrt(square + height * height)
            radii += r
            curvatures += (-1.0 if height < 0.0 else 1.0) / r
            count += 1
        if not count:
            return None
        r = radii / count
        height = math.sqrt(max(0.0, r * r - square))
        if curvatures < 0.0:
            height = -height
        k = (f * f + radius * radius + z * z - square) / (2.0 * radius)
        n = z * z + height * height
        rest = n - k * k
        if not (n > 0.0 and rest >= 0.0):
            return None
        root = math.sqrt(rest)
        return direction(z * k + abs(height) * root, height * k - (-z if height < 0.0 else z) * root)
