"""The connectivity bitstream of docs/FORMAT.md, and its coder 1; a part of independent_decoder.py."""

import struct

from independent_streams import Model, Reader, Stream, crc32c, need
from independent_surface import decode_surface

NONE = -1


class Slot:
    def __init__(self, vertex=NONE):
        self.vertex, self.before, self.after, self.opposite, self.valence = vertex, NONE, NONE, 0, 0


class Slots:
    def __init__(self, vertex_count, triangle_count):
        useful, size = max(1, min(vertex_count, 3 * triangle_count, 2**22)), 1
        while size < useful:
            size *= 2
        self.table = [Slot() for _ in range(size)]

    def look_up(self, v):
        slot = self.table[v % len(self.table)]
        return slot if slot.vertex == v else Slot()

    def claim(self, v):
        at = v % len(self.table)
        if self.table[at].vertex != v:
            self.table[at] = Slot(v)
        return self.table[at]


class Guess:
    def __init__(self, candidates):
        self.costs, self.models, self.best = [0] * candidates, [Model() for _ in range(candidates)], 0


class ConnectivityDecoder:
    def __init__(self, stream, vertex_count, triangle_count):
        self.stream, self.vertex_count, self.last = stream, vertex_count, vertex_count - 1
        self.next, self.recent, self.slots = 0, [], Slots(vertex_count, triangle_count)
        self.previous = self.previous_free = (0, 0, 0)
        self.previous_third = self.previous_other = 0
        self.anchor, self.corners, self.third = Guess(5), [Guess(5) for _ in range(3)], Guess(6)
        self.far_high, self.far_low = Model(), Model()
        self.attachments, self.thirds = [Model() for _ in range(25)], [Model() for _ in range(32)]
        self.context = 0

    def index(self, guess, candidates):
        d = self.stream.value(guess.models[guess.best])
        if d > 0:
            d -= 1
        elif d == 0:
            d = 32768 * self.stream.value(self.far_high)
            d += self.stream.value(self.far_low)
        v = candidates[guess.best] + d
        need(0 <= v <= self.last, "an index out of range")
        for i, candidate in enumerate(candidates):
            old = guess.costs[i]
            guess.costs[i] = old + 16 * abs(v - candidate).bit_length() - old // 16
        guess.best = guess.costs.index(min(guess.costs))
        return v

    def symbol(self, model, count):
        value = self.stream.value(model)
        symbol = 2 * value if value >= 0 else -2 * value - 1
        need(symbol < count, "no such symbol")
        return symbol

    def free_candidates(self, k, t):
        first = k == 0
        return [self.previous[k], self.previous[2] if first else t[k - 1], min(self.next, self.last),
                self.previous[1] if first else t[0], self.previous_free[k]]

    def triangle(self):
        look_up = self.slots.look_up
        attachment = self.symbol(self.attachments[self.context], 31)
        age, corner, third, t = 0, 0, 4, [0, 0, 0]
        if attachment == 3:
            for k in range(3):
                t[k] = self.index(self.corners[k], self.free_candidates(k, t))
        else:
            if attachment < 3:
                corner = attachment
                p = self.index(self.anchor, self.free_candidates(0, t))
                q = look_up(p).after
                need(q != NONE, "no gate leaves the anchor")
            else:
                age, corner = divmod(attachment - 4, 3)
                need(age < len(self.recent), "no gate of that age")
                p, q = self.recent[age]
            right, left = look_up(q).after, look_up(p).before
            third = self.symbol(self.thirds[4 * min(look_up(q).valence, 7) + 2 * (right != NONE) + (left != NONE)], 4)
            if third == 0:
                c = self.next if self.next <= self.last else NONE
            elif third < 3:
                c = right if third == 1 else left
            else:
                fourth = min(max(p + q - look_up(p).opposite, 0), self.last)
                c = self.index(self.third, [q, p, self.previous_third, min(self.next, self.last),
                                            self.previous_other, fourth])
            need(c != NONE, "no such third vertex")
            t[corner], t[(corner + 1) % 3], t[(corner + 2) % 3] = p, q, c
        self.move_on(tuple(t), attachment, age, corner, third)
        return t

    def move_on(self, t, attachment, age, corner, third):
        p, q, c = t[corner], t[(corner + 1) % 3], t[(corner + 2) % 3]
        for v in t:
            self.slots.claim(v).valence += 1
            self.next = max(self.next, v + 1)
        self.edge(p, q, c)
        self.edge(c, p, q)
        self.edge(q, c, p)
        self.previous, self.previous_third = t, c
        if attachment == 3:
            self.previous_free = t
        if third == 3:
            self.previous_other = c
        kind = 0 if attachment < 3 else 1 if attachment == 3 else 2 + min(age, 2)
        self.context = 5 * kind + third

    def edge(self, a, b, opposite):
        start, end = self.slots.look_up(a), self.slots.look_up(b)
        closed = start.after == b or end.before == a
        if start.after == b:
            start.after = NONE
        if end.before == a:
            end.before = NONE
        if closed:
            if (a, b) in self.recent:
                self.recent.remove((a, b))
            return
        start = self.slots.claim(b)
        start.after, start.opposite = a, opposite
        self.slots.claim(a).before = b
        self.recent = [(b, a), *self.recent][:9]


def decode_connectivity(data):
    reader = Reader(data)
    need(reader.take(4) == b"BENM" and reader.get("B") == 1, "no connectivity of version 1")
    need(reader.left() >= 4 and crc32c(data[:-4]) == struct.unpack("<I", data[-4:])[0], "checksum of the connectivity")
    reader = Reader(data[5:-4])
    coder = reader.get("B")
    need(coder in (1, 2), "an unknown connectivity coder")
    vertex_count, triangle_count = reader.varint(2**31 - 1), reader.varint(2**63 - 1)
    payload = reader.take(reader.varint(len(data)))
    need(reader.left() == 0, "bytes left over")
    if coder == 2:
        return vertex_count, decode_surface(Reader(payload), vertex_count, triangle_count)
    need(2 * triangle_count <= (8 * len(payload) + 64) * 3024, "more triangles than the bytes can hold")
    decoder = ConnectivityDecoder(Stream(payload), vertex_count, triangle_count)
    triangles = [decoder.triangle() for _ in range(triangle_count)]
    decoder.stream.finish()
    return vertex_count, triangles
