"""Triangles glued to a surface, as coder 2 of the connectivity bitstream in docs/FORMAT.md has it; a part of
independent_decoder.py."""


def following(h):
    """The half-edge after h in its triangle."""
    return h - 2 if h % 3 == 2 else h + 1


def preceding(h):
    return h + 2 if h % 3 == 0 else h - 1


class Surface:
    """triangles: flipped ones with their last two corners exchanged. twin: of each half-edge, None without. fan: the
    number of the fan of the corner where a half-edge begins. fan_size, fan_is_open: of each fan."""

    def __init__(self, triangles):
        self.triangles = [tuple(t) for t in triangles]
        count = len(self.triangles)
        self.is_flipped = [False] * count
        self.twin = [None] * (3 * count)
        edges = {}  # by smaller and larger vertex: half-edges in their order
        for t, corners in enumerate(self.triangles):
            if len(set(corners)) < 3:
                continue
            for k in range(3):
                ends = tuple(sorted((corners[k], corners[(k + 1) % 3])))
                edges.setdefault(ends, []).append(3 * t + k)
        for run in edges.values():
            if len(run) == 2:
                self.glue(*run)
        self.orient()
        for run in edges.values():
            if len(run) > 2:
                run = [self.renamed(h) for h in run]
                rising = [h for h in run if self.start(h) < self.end(h)]
                falling = [h for h in run if self.start(h) > self.end(h)]
                for g, h in zip(rising, falling):
                    self.glue(g, h)
        self.find_fans()

    def start(self, h):
        return self.triangles[h // 3][h % 3]

    def end(self, h):
        return self.start(following(h))

    def third(self, h):
        return self.start(preceding(h))

    def glue(self, g, h):
        self.twin[g], self.twin[h] = h, g

    def orient(self):
        """Winds triangles that are glued alike; cuts where that cannot be."""
        seen = [False] * len(self.triangles)
        for first in range(len(seen)):
            if seen[first]:
                continue
            seen[first] = True
            waiting = [first]
            while waiting:
                t = waiting.pop()
                for h in range(3 * t, 3 * t + 3):
                    other = self.twin[h]
                    if other is None:
                        continue
                    n = other // 3
                    same_way = (self.start(h) < self.end(h)) == (self.start(other) < self.end(other))
                    flip = self.is_flipped[t] != same_way
                    if not seen[n]:
                        seen[n], self.is_flipped[n] = True, flip
                        waiting.append(n)
                    elif self.is_flipped[n] != flip:
                        self.twin[h] = self.twin[other] = None
        twin = list(self.twin)
        for h, other in enumerate(twin):
            self.twin[self.renamed(h)] = None if other is None else self.renamed(other)
        self.triangles = [(a, c, b) if flipped else (a, b, c)
                          for (a, b, c), flipped in zip(self.triangles, self.is_flipped)]

    def renamed(self, h):
        """What a half-edge is called once its triangle is flipped, if it is."""
        return h - h % 3 + 2 - h % 3 if self.is_flipped[h // 3] else h

    def find_fans(self):
        self.fan, self.fan_size, self.fan_is_open = [None] * len(self.twin), [], []
        for first in range(len(self.twin)):
            if self.fan[first] is not None:
                continue
            h, is_open = first, False
            while True:  # back to where the fan begins
                before = self.twin[h]
                if before is None:
                    is_open = True
                    break
                h = following(before)
                if h == first:
                    break
            size = 0
            while h is not None and self.fan[h] is None:
                self.fan[h] = len(self.fan_size)
                size += 1
                h = self.twin[preceding(h)]
            self.fan_size.append(size)
            self.fan_is_open.append(is_open)
