"""Streams of bits of docs/FORMAT.md; a part of independent_decoder.py."""

from bisect import bisect_left
from operator import add, mul

from independent_streams import need

LIMIT = 2815


def make_squash():
    table = []
    for x in range(-LIMIT, LIMIT + 1):
        small, term, e = (abs(x) / 256) / 64, 1.0, 1.0
        for k in range(1, 12):
            term = (term * small) / k
            e += term
        for _ in range(6):
            e *= e
        table.append(min(max(int(65536 * (1 / (1 + e) if x < 0 else e / (1 + e)) + 0.5), 1), 65535))
    return table


SQUASH = make_squash()  # from x = -LIMIT on
STRETCH = [min(bisect_left(SQUASH, 16 * p + 8), 2 * LIMIT) - LIMIT for p in range(4096)]
RATE = [655360 // (10 * n + 16) for n in range(1001)]


class BitStream:
    def __init__(self, data):
        self.data, self.at = data, 4
        self.low, self.high, self.window = 0, 2**32 - 1, int.from_bytes(data[:4].ljust(4, b"\0"), "big")

    def bit(self, probability):
        middle = self.low + ((self.high - self.low) * probability >> 16)
        bit = self.window <= middle
        if bit:
            self.high = middle
        else:
            self.low = middle + 1
        while self.low >> 24 == self.high >> 24:
            self.low = self.low << 8 & 0xFFFFFFFF
            self.high = self.high << 8 & 0xFFFFFFFF | 255
            byte = self.data[self.at] if self.at < len(self.data) else 0
            self.window = self.window << 8 & 0xFFFFFFFF | byte
            self.at += 1
            need(self.at <= len(self.data) + 4, "a stream of bits ends too early")
        return int(bit)

    def finish(self):
        last = (self.low >> 24) + (self.low & 0xFFFFFF != 0)
        need(len(self.data) == self.at - 4 + (last != 0) and self.window == last << 24,
             "a stream of bits does not end where its values do")


class AdaptiveBits:
    """A list of adaptive bits."""

    def __init__(self, count=1):
        self.p, self.n = [2**21] * count, [0] * count

    def learn(self, i, bit):
        p, n = self.p[i], self.n[i]
        self.p[i] = p + (((4194303 if bit else 0) - p) * RATE[n] >> 16)
        self.n[i] = min(n + 1, 1000)

    def code(self, stream, i=0):
        bit = stream.bit(min(max(self.p[i] >> 6, 1), 65535))
        self.learn(i, bit)
        return bit


class MixedBits:
    def __init__(self, counts, sets):
        self.bits = AdaptiveBits(sum(counts))
        self.first = [sum(counts[:i]) for i in range(len(counts))]
        self.weights = [[16384] * len(counts) + [0] for _ in range(sets)]

    def code(self, stream, contexts, number):
        p, n, weights = self.bits.p, self.bits.n, self.weights[number]
        places = list(map(add, self.first, contexts))
        x = [STRETCH[p[i] >> 10] for i in places]
        x.append(128)
        m = sum(map(mul, weights, x)) >> 16
        probability = SQUASH[min(max(m, -LIMIT), LIMIT) + LIMIT]
        bit = stream.bit(probability)
        target, error = (4194303, 65536 - probability) if bit else (0, -probability)
        for i, value in enumerate(x):
            w = weights[i] + (value * error >> 14)
            weights[i] = w if -2**20 <= w <= 2**20 else 2**20 if w > 0 else -2**20
        for i in places:  # as AdaptiveBits.learn, without calls
            p[i] += (target - p[i]) * RATE[n[i]] >> 16
            if n[i] < 1000:
                n[i] += 1
        return bit


class Count:
    def __init__(self):
        self.length, self.leading = AdaptiveBits(40), [AdaptiveBits(4) for _ in range(41)]

    def code(self, stream):
        digits, number = 0, 1
        while digits < 40 and self.length.code(stream, digits):
            digits += 1
        for _ in range(digits):
            number = 2 * number + (self.leading[digits].code(stream, number) if number < 4 else stream.bit(32768))
        return number - 1


class Difference:
    def __init__(self):
        self.magnitude, self.sign, self.last = Count(), AdaptiveBits(2), 0

    def code(self, stream):
        magnitude = self.magnitude.code(stream)
        if magnitude == 0:
            return 0
        self.last = self.sign.code(stream, self.last)
        return -magnitude if self.last else magnitude
