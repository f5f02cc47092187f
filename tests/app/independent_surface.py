"""Coder 2 of the connectivity bitstream of docs/FORMAT.md; a part of independent_decoder.py."""

from independent_bits import AdaptiveBits, BitStream, Count, MixedBits
from independent_order import OrderDecoder
from independent_streams import need


class Fan:
    def __init__(self, vertex, size, is_open):
        self.vertex, self.size, self.open = vertex, size, is_open
        self.left, self.wedges, self.borders = size, 1, 0
        self.kind = 9 + min(size, 6) if is_open else min(max(size - 2, 0), 8)


class FrontEdge:
    def __init__(self, start, behind):
        self.start, self.behind = start, behind  # `from` of the document is a word of Python's
        self.before = self.after = None
        self.active, self.border = True, False

    def to(self):
        return self.after.start


def link(a, b):
    a.after, b.before = b, a


def left_context(u, w):
    return 8 * min(u.left, 7) + min(w.left, 7)


class SurfaceDecoder:
    def __init__(self, stream, vertex_count, triangle_count):
        self.stream, self.vertex_count, self.triangle_count = stream, vertex_count, triangle_count
        self.triangles, self.edges, self.stacks, self.vertices = [], [], [[] for _ in range(16)], 0
        self.last_flip = self.last_again = self.last_open = self.kind1 = self.kind2 = 0
        self.flip, self.again, self.join = AdaptiveBits(2), AdaptiveBits(2), AdaptiveBits(2)
        self.near, self.forward = AdaptiveBits(), AdaptiveBits()
        self.again_age, self.large_size, self.far_age, self.steps = Count(), Count(), Count(), Count()
        self.border = MixedBits([64, 1024, 16], 1)
        self.new = MixedBits([64, 256], 4)
        self.open = MixedBits([256, 1088, 256, 2], 17)
        self.size = MixedBits([48, 3072, 12288, 12288, 12288, 12288], 48)

    def run(self):
        while len(self.triangles) < self.triangle_count:
            self.start_piece()
            while (gate := self.take_gate()) is not None:
                self.cross(gate)
        self.stream.finish()
        return self.triangles

    def start_piece(self):
        a, b, c = self.make_fan(None), self.make_fan(None), self.make_fan(None)
        self.place(a, b, c)
        e = [self.make_edge(b, c), self.make_edge(c, a), self.make_edge(a, b)]
        link(e[0], e[2])
        link(e[1], e[0])
        link(e[2], e[1])
        for edge in e:
            self.queue(edge)

    def make_edge(self, start, behind):
        edge = FrontEdge(start, behind)
        edge.number = len(self.edges)
        self.edges.append(edge)
        return edge

    def queue(self, e):
        if not e.border:
            self.stacks[min(15, 2 * min(e.start.left, 15) + min(e.to().left, 15))].append(e)

    def take_gate(self):
        for stack in self.stacks:
            while stack:
                e = stack.pop()
                if e.active and not e.border:
                    return e
        return None

    def place(self, u, w, x):
        self.last_flip = self.flip.code(self.stream, self.last_flip)
        for fan in (u, w, x):
            fan.left -= 1
        need(len(self.triangles) < self.triangle_count, "too many triangles")
        corners = (u, x, w) if self.last_flip else (u, w, x)
        self.triangles.append(tuple(fan.vertex for fan in corners))

    def make_fan(self, e):
        self.last_again = self.again.code(self.stream, self.last_again)
        if self.last_again:
            vertex = self.vertices - 1 - self.again_age.code(self.stream)
            need(vertex >= 0, "no such vertex")
        else:
            vertex = self.vertices
            self.vertices += 1
            need(self.vertices <= self.vertex_count, "too many vertices")

        ends = sides = left = b = behind = 0
        if e is not None:
            u, w = e.start, e.to()
            ends, sides = 16 * u.kind + w.kind, 16 * e.before.start.kind + e.after.to().kind
            left, b, behind = left_context(u, w), 1 + 4 * u.borders + w.borders, e.behind.kind
        self.last_open = self.open.code(self.stream, (ends, 64 * b + left, sides, self.last_open), b)

        def bit(i):
            j = i + 24 * self.last_open
            return self.size.code(self.stream, (j, 64 * j + left, 256 * j + ends, 256 * j + sides,
                                                256 * j + 16 * behind + self.kind1,
                                                256 * j + 16 * self.kind1 + self.kind2), j)

        size = 3 if self.last_open else 6
        if not bit(0):
            if bit(1):
                size, i = size - 1, 2
                while size > 1 and bit(i):
                    size, i = size - 1, i + 1
            else:
                size, i = size + 1, 8
                while i < 23 and bit(i):
                    size, i = size + 1, i + 1
                if i == 23:
                    size += self.large_size.code(self.stream)
        need(size <= self.triangle_count, "a fan larger than the mesh")
        fan = Fan(vertex, size, self.last_open)
        self.kind1, self.kind2 = fan.kind, self.kind1
        return fan

    def fills_wedge(self, fan):
        if not fan.open and fan.left == fan.wedges:
            return True
        return fan.wedges != 1 and bool(self.join.code(self.stream, fan.open))

    def is_border(self, u, w):
        if u.left == 0 or w.left == 0:
            return True
        if not (u.open and w.open):
            return False
        left, borders = left_context(u, w), 4 * u.borders + w.borders
        return bool(self.border.code(self.stream, (left, 64 * borders + left, borders), 0))

    def cross(self, e):
        """Passes a gate."""
        u, w, before, after = e.start, e.to(), e.before, e.after
        if self.is_border(u, w):
            e.border = True
            for fan in (u, w):
                fan.borders = min(fan.borders + 1, 3)
            return
        at_u = self.fills_wedge(u)
        at_w = self.fills_wedge(w)
        meets = None
        if at_u or at_w:
            x = before.start if at_u else after.to()
            need(not at_w or x is after.to(), "two wedges that do not fit")
            need(not (at_u and before.border) and not (at_w and after.border), "a border is joined")
        else:
            left, o = left_context(u, w), 2 * u.open + w.open
            if self.new.code(self.stream, (left, 64 * o + left), o):
                x = self.make_fan(e)
            else:
                meets = self.meet(e)
                x = meets.start
        need(x is not u and x is not w and x.left > 0, "no place for a triangle")
        self.place(u, w, x)

        first = None if at_u else self.make_edge(u, w)
        second = None if at_w else self.make_edge(x, u)
        e.active = False
        if at_u:
            before.active = False
            u.wedges -= 1
        if at_w:
            after.active = False
            w.wedges -= 1
        if at_u and at_w:
            x.wedges -= 1
            if before.before is not after:
                link(before.before, after.after)
        elif at_u:
            link(before.before, second)
            link(second, after)
        elif at_w:
            beyond = after.after
            link(before, first)
            link(first, beyond)
        elif meets is None:
            link(before, first)
            link(first, second)
            link(second, after)
        else:
            x.wedges += 1
            arrives = meets.before
            link(before, first)
            link(first, meets)
            link(arrives, second)
            link(second, after)
        made = [edge for edge in (first, second) if edge is not None]
        for edge in made:
            self.queue(edge.before)
            self.queue(edge.after)
        for edge in made:
            self.queue(edge)

    def meet(self, e):
        if not self.near.code(self.stream):
            number = len(self.edges) - 1 - self.far_age.code(self.stream)
            need(number >= 0, "no such edge of the front")
            meets = self.edges[number]
            need(meets.active and meets is not e and meets is not e.after, "an edge that cannot be met")
            return meets
        forward, n = self.forward.code(self.stream), self.steps.code(self.stream) + 1
        need(n <= 64, "too far along the front")
        meets = e.after if forward else e
        for _ in range(n):
            for _ in range(64):
                meets = meets.after if forward else meets.before
                need(meets is not e and (forward or meets is not e.after), "round the front")
                if meets.start is not e.start and meets.start is not e.to() and meets.start.left > 0:
                    break
            else:
                need(False, "too far along the front")
        return meets


def decode_surface(reader, vertex_count, triangle_count):
    """Triangles of the payload of coder 2, which ends where the reader does."""
    need(triangle_count <= 715827882, "too many triangles")
    order = reader.get("B")
    need(order <= 1, "an unknown order")
    stream = BitStream(reader.take(reader.varint(reader.left())))
    triangles = SurfaceDecoder(stream, vertex_count, triangle_count).run()
    rest = reader.take(reader.left())
    if order == 0:
        need(not rest, "an order where none is wanted")
        return triangles
    return OrderDecoder(BitStream(rest), triangles, vertex_count).run()
