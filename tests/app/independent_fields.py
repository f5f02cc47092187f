"""Fields of RTPCA in docs/FORMAT.md: an integer for each vertex of an order; a part of independent_decoder.py."""

from bisect import bisect_right

from independent_mixed import MixedInteger, ShortNumber, class_of, magnitude_of
from independent_static import traverse_mesh


def round_quotient(a, b):
    return (2 * a + b) // (2 * b)


def side_of(u):
    steps = bisect_right((2, 6, 16, 64), abs(u))
    return 4 - steps if u < 0 else 4 + steps


class Order:
    """vertices: in their order. gates, neighbours: of each, by places in it."""

    def __init__(self, vertices, gates, neighbours):
        place = {v: k for k, v in enumerate(vertices)}
        self.vertices = vertices
        self.gates = [[tuple(place[w] for w in gate) for gate in gates[v] if all(w in place for w in gate)]
                      for v in vertices]
        self.neighbours = [sorted(place[w] for w in neighbours[v] if place.get(w, k) < k)[:8]
                           for k, v in enumerate(vertices)]


class Mesh:
    def __init__(self, triangles, vertex_count):
        traversal = traverse_mesh(triangles, vertex_count)
        self.vertices = [v for v, *_ in traversal]
        self.gates = {v: [gate[:3] for gate in gates] for v, gates, *_ in traversal}
        self.neighbours = [set() for _ in range(vertex_count)]
        for t in triangles:
            for v in t:
                self.neighbours[v].update(w for w in t if w != v)

    def order(self, vertices):
        """Of vertices in the order of the traversal."""
        return Order(vertices, self.gates, self.neighbours)


class Points:
    def order(self, vertices):
        gates = dict.fromkeys(vertices, ())
        return Order(vertices, gates, {v: vertices[max(k - 2, 0):k] for k, v in enumerate(vertices)})


class Memory:
    def __init__(self, order):
        self.order, self.size, self.fields = order, [0] * len(order.vertices), 0


class FieldCoder:
    def __init__(self):
        self.predictor = ShortNumber(3)
        self.integer = MixedInteger([192, 216, 576, 960, 72])

    def code(self, stream, memory):
        """Predictor, and the integers of the vertices in their order."""
        predictor, fields = min(self.predictor.code(stream), 4), min(memory.fields, 7)
        memory.fields += 1
        size, order = memory.size, memory.order
        x, residuals, sizes = [], [], []
        for v, (gates, neighbours) in enumerate(zip(order.gates, order.neighbours)):
            mean = near = trend = 0
            g, k = len(gates), len(neighbours)
            if k:
                mean = round_quotient(8 * sum([x[w] for w in neighbours]), k)
                near = 512 * sum([sizes[w] for w in neighbours]) // k
                trend = round_quotient(8 * sum([residuals[w] for w in neighbours]), k)
            plane = mean
            if g:
                plane = round_quotient(8 * sum(x[left] + x[right] - x[opposite] for left, right, opposite in gates), g)
            p = (plane, (plane + mean) // 2, mean, mean // 2, 0)[predictor]
            whole = (p + 4) // 8
            part = p - 8 * whole + 4
            other = (mean if predictor < 2 else plane) - p
            past = 32 * size[v]
            both = class_of((3 * near + past) // 4 if k else past)
            r = self.integer.code(stream, (
                8 * both + part,
                9 * class_of(near) + side_of(other),
                24 * class_of(past) + class_of(near),
                24 * (8 * (min(k, 3) + (g > 0)) + fields) + both,
                8 * side_of(trend) + part))
            residuals.append(r)
            sizes.append(magnitude_of(r))
            x.append(min(max(whole + r, -2**29), 2**29))
            size[v] += (16 * sizes[v] - size[v] + 1) // 2
        return predictor, x
