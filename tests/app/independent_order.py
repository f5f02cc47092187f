"""Gluing triangles and the order of the file, of docs/FORMAT.md; a part of independent_decoder.py."""

from bisect import bisect_left

from independent_bits import AdaptiveBits, Count, Difference, MixedBits
from independent_streams import need
from independent_surface_gluing import Surface, following, preceding

NONE = -1


class Glued:
    """flipped of each triangle; start and twin of each half-edge."""

    def __init__(self, triangles):
        surface = Surface(triangles)
        self.flipped = [int(flip) for flip in surface.is_flipped]
        self.start = [v for t in surface.triangles for v in t]
        self.twin = [NONE if o is None else o for o in surface.twin]


class Jumps:
    def __init__(self, count):
        self.rest, self.front = list(range(count)), []  # front: places, which rise
        self.item_at, self.place, self.visited = [], {}, [False] * count
        self.last = self.cursor = self.was_front = 0
        self.to_front, self.front_step, self.rest_step = AdaptiveBits(2), Difference(), Difference()

    def meet(self, item):
        if not self.visited[item] and item not in self.place:
            self.place[item] = len(self.item_at)
            self.front.append(len(self.item_at))
            self.item_at.append(item)

    def visit(self, item):
        self.visited[item], self.last = True, item
        del self.rest[bisect_left(self.rest, item)]
        if item in self.place:
            del self.front[bisect_left(self.front, self.place[item])]

    def code(self, stream):
        if not self.front or len(self.front) == len(self.rest):
            self.was_front = 1 if self.front else 0
        else:
            self.was_front = self.to_front.code(stream, self.was_front)
        if self.was_front:
            rank = self.cursor + self.front_step.code(stream)
            need(0 <= rank < len(self.front), "no such rank")
            self.cursor = rank
            return self.item_at[self.front[rank]]
        rank = bisect_left(self.rest, self.last) + self.rest_step.code(stream)
        need(0 <= rank < len(self.rest), "no such rank")
        return self.rest[rank]


class OrderDecoder:
    def __init__(self, stream, triangles, vertex_count):
        self.stream, self.triangles, self.vertex_count = stream, triangles, vertex_count
        self.glued, self.turn, self.appeared = Glued(triangles), [0] * len(triangles), {}

    def run(self):
        order = self.order_triangles()
        index = self.order_vertices()
        self.stream.finish()
        return [tuple(index[v] for v in self.in_file(t)) for t in order]

    def in_file(self, t):
        """Corners from the one where the triangle begins in the file."""
        corners, turn = self.triangles[t], self.turn[t]
        return corners[turn:] + corners[:turn]

    def half_at(self, t, k):
        c = (k + self.turn[t]) % 3
        return 3 * t + ((3 - c) % 3 if self.glued.flipped[t] else c)

    def neighbours(self, last, visited):
        found, twin = {}, self.glued.twin

        def add(h, slot):
            t = h // 3
            if t != last and not visited[t] and t not in found:
                found[t] = slot

        for k in range(3):
            o = twin[self.half_at(last, k)]
            if o != NONE:
                add(o, 1 + k)
        for k in range(3):
            h = self.half_at(last, k)
            for i in range(5):
                h = twin[preceding(h)]
                if h == NONE or h // 3 == last:
                    break
                if i > 0:
                    add(h, 4 + 5 * k + i)
        return list(found.items())

    def order_triangles(self):
        stream, twin, flipped = self.stream, self.glued.twin, self.glued.flipped
        near = MixedBits([64, 152, 361], 1)
        following_one = MixedBits([19, 361, 6859, 304, 5776], 19)
        turning = MixedBits([38, 342, 114, 54], 2)
        jumps, order = Jumps(len(self.triangles)), []
        last, s1, s2, history, r = NONE, 0, 0, 0, 0

        def is_done(h):
            return twin[h] == NONE or jumps.visited[twin[h] // 3]

        for _ in self.triangles:
            t, slot = NONE, 0
            neighbours = [] if last == NONE else self.neighbours(last, jumps.visited)
            if neighbours:
                is_near = near.code(stream, (history % 64, 8 * s1 + min(len(neighbours), 7), 19 * s1 + s2), 0)
                history = (2 * history + is_near) % 64
                if is_near:
                    for candidate, s in neighbours[:-1]:
                        z = 4 * sum(v in self.appeared for v in self.triangles[candidate])
                        z += sum(is_done(h) for h in range(3 * candidate, 3 * candidate + 3))
                        if following_one.code(stream, (s, 19 * s + s1, 361 * s + 19 * s1 + s2, 16 * s + z,
                                                       16 * (19 * s + s1) + z), s):
                            t, slot = candidate, s
                            break
                    else:
                        t, slot = neighbours[-1]
            if t == NONE:
                t = jumps.code(stream)
            jumps.visit(t)
            for h in range(3 * t, 3 * t + 3):
                if twin[h] != NONE:
                    jumps.meet(twin[h] // 3)

            ages = [self.appeared.get(v, len(self.appeared)) for v in self.triangles[t]]
            o, y = ages.index(min(ages)), ages.index(max(ages))
            f = o
            if 1 <= slot <= 3:
                g = twin[self.half_at(last, slot - 1)] % 3
                f = (5 - g) % 3 if flipped[t] else g
            z = 3 * ((y - f) % 3) + (o - f) % 3

            def bit(j):
                return turning.code(stream, (2 * slot + j, 2 * (9 * slot + z) + j, 2 * (3 * slot + r) + j,
                                             2 * (9 * r + z) + j), j)

            r = 0 if bit(0) else 1 if bit(1) else 2
            self.turn[t] = (r + f) % 3
            for v in self.in_file(t):
                self.appeared.setdefault(v, len(self.appeared))
            s1, s2, last = slot, s1, t
            order.append(t)
        return order

    def make_starts(self):
        """For each vertex the half-edge where its ring begins."""
        starts = {}
        for h, v in enumerate(self.glued.start):
            if v not in starts or self.glued.twin[h] == NONE:
                starts[v] = h
        return starts

    def ring(self, h):
        first, ring = h, []
        while True:
            ring.append(self.glued.start[following(h)])
            back = preceding(h)
            h = self.glued.twin[back]
            if h == NONE:
                ring.append(self.glued.start[back])
            if h in (NONE, first) or len(ring) >= 64:
                return ring

    def order_vertices(self):
        stream, place, vertex_at = self.stream, self.appeared, list(self.appeared)
        gap, mixed, jumps = Count(), MixedBits([27, 729, 19683, 2916], 27), Jumps(len(vertex_at))
        starts, visited, index = self.make_starts(), jumps.visited, {}
        last = before = NONE
        s1 = s2 = at = 0

        def candidates():
            lowest = vertex_at[jumps.rest[0]]
            yield lowest, 1, 0
            if last == NONE:
                return
            follows = place[last] + 1
            second = vertex_at[follows] if follows < len(vertex_at) and not visited[follows] else NONE
            if second not in (NONE, lowest):
                yield second, 2, 0
            ring, slot = self.ring(starts[last]), 3
            if before in ring:
                turn, slot = ring.index(before), 15
                ring = ring[turn:] + ring[:turn]
            done = [visited[place[v]] for v in ring]
            for i, v in enumerate(ring):
                if not done[i] and v not in (lowest, second):
                    yield v, slot + min(i, 11), done[(i + 1) % len(ring)] + 2 * done[i - 1]

        for _ in vertex_at:
            at += gap.code(stream)
            need(at < self.vertex_count, "an index out of range")
            for v, slot, z in candidates():
                if mixed.code(stream, (slot, 27 * slot + s1, 729 * slot + 27 * s1 + s2, 4 * (27 * slot + s1) + z), slot):
                    break
            else:
                v, slot = vertex_at[jumps.code(stream)], 0
            jumps.visit(place[v])
            for w in self.ring(starts[v]):
                jumps.meet(place[w])
            index[v] = at
            at += 1
            last, before, s1, s2 = v, last, slot, s1
        return index
