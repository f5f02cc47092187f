"""Short numbers and integers in mixed contexts of docs/FORMAT.md; a part of independent_decoder.py."""

from independent_bits import AdaptiveBits, MixedBits


def digits_of(x):
    return x.bit_length()


def magnitude_of(r):
    """What is written |r|'."""
    return min(abs(r), 65536)


def class_of(expectation):
    if expectation < 16:
        return 0
    e = expectation.bit_length() - 1
    return min(2 * (e - 4) + 1 + (2 * expectation >= 3 << e), 23)


def half_class_of(expectation):
    return class_of(expectation) // 2


class ShortNumber:
    def __init__(self, digits):
        self.digits, self.bits = digits, AdaptiveBits(1 << digits)

    def code(self, stream):
        node = 1
        for _ in range(self.digits):
            node = 2 * node + self.bits.code(stream, node)
        return node - (1 << self.digits)


class MixedInteger:
    """counts: how many values each context takes."""

    def __init__(self, counts):
        self.bits = MixedBits([64 * count for count in counts], 64)
        self.second = [AdaptiveBits(2) for _ in range(32)]

    def code(self, stream, contexts):
        starts = [64 * value for value in contexts]

        def decide(number):
            return self.bits.code(stream, [start + number for start in starts], number)

        if not decide(0):
            return 0
        negative, digits, magnitude = decide(1), 1, 1
        while digits < 31 and decide(1 + digits):
            digits += 1
        for k in range(1, digits):
            if k == 1:
                bit = decide(30 + digits)
            elif k == 2:
                bit = self.second[digits].code(stream, magnitude & 1)
            else:
                bit = stream.bit(32768)
            magnitude = 2 * magnitude + bit
        return -magnitude if negative else magnitude
