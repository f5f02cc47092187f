"""Basic types and coded integers of docs/FORMAT.md; a part of independent_decoder.py."""

import math
import struct


class Corrupt(Exception):
    pass


def need(condition, message):
    if not condition:
        raise Corrupt(message)


# Basic types


def make_crc_table():
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = (byte >> 1) ^ (0x82F63B78 if byte & 1 else 0)
        table.append(byte)
    return table


CRC_TABLE = make_crc_table()


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ CRC_TABLE[(crc ^ byte) & 255]
    return crc ^ 0xFFFFFFFF


def int32(value):
    return (value + 2**31) % 2**32 - 2**31


class Reader:
    """Takes values from bytes and never reads past them."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def left(self):
        return len(self.data) - self.at

    def take(self, count):
        need(count <= self.left(), "the bytes end too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def get(self, form):
        return struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))[0]

    def varint(self, limit):
        value = 0
        for i in range(10):
            byte = self.get("B")
            value |= (byte & 127) << 7 * i
            if byte < 128:
                need(i == 0 or byte != 0, "a padded number")
                need(value < 2**64 and value <= limit, f"{value} is above {limit}")
                return value
        raise Corrupt("a number of more than 64 bits")


# Coded integers

ESCAPE = 223


def make_tokens():
    """Per token: value, direction and number of its plain bits."""
    tokens = [(t - 7, 1, 0) for t in range(15)]
    for r in range(ESCAPE - 15):
        s = r // 16
        magnitude = (8 + r % 16 // 2) << s
        tokens.append((magnitude, 1, s) if r % 2 == 0 else (-magnitude, -1, s))
    return tokens


TOKENS = make_tokens()


def power(base, e):
    result = 1.0
    while e > 0:
        if e % 2:
            result *= base
        e //= 2
        base *= base
    return result


class Model:
    def __init__(self, prior=None):
        self.counts = [0] * 224
        self.counts[ESCAPE] = 32
        self.until_update, self.interval = 0, 1
        self.slots = []  # (token, cumulative, frequency) of each of the 4096
        if prior is None:
            return
        self.interval = 16
        m = min(max(prior, 0.001), 40000.0)
        ratio = (math.sqrt(1 + m * m) - 1) / m
        for token, (value, _, s) in enumerate(TOKENS):
            if value == 0:
                mass = (1 - ratio) / (1 + ratio)
            else:
                a = abs(value)
                mass = (power(ratio, a) - power(ratio, a + 2**s)) / (1 + ratio)
            self.counts[token] = math.floor(mass * 4096 + 0.5)

    def update(self):
        total = sum(self.counts)
        if total > 2097152:
            self.counts = [c - c // 2 for c in self.counts]
            total = sum(self.counts)
        scale = 2**44 // total
        frequency, running, before, missing = [], 0, 0, 0
        for count in self.counts:
            running += count
            after = (running * scale + 2**31) // 2**32
            f = after - before
            before = after
            if f == 0 and count:
                f, missing = 1, missing + 1
            frequency.append(f)
        while missing:
            largest = max(frequency)
            taken = min(missing, largest // 2)
            frequency[frequency.index(largest)] -= taken
            missing -= taken
        self.slots = []
        for token, f in enumerate(frequency):
            self.slots += [(token, len(self.slots), f)] * f
        self.until_update = self.interval
        self.interval = min(1024, 2 * self.interval)


class Stream:
    def __init__(self, data):
        self.empty = not data
        if self.empty:
            return
        reader = Reader(data)
        plain_size = reader.varint(len(data))
        self.states = [reader.get("I"), reader.get("I")]
        need(reader.left() >= plain_size and (reader.left() - plain_size) % 2 == 0, "a stream of impossible size")
        words = reader.take(reader.left() - plain_size)
        self.words = iter(struct.unpack(f"<{len(words) // 2}H", words))
        self.plain = int.from_bytes(reader.take(plain_size), "little")
        self.plain_left = 8 * plain_size
        self.turn = 0

    def bits(self, count):
        need(count <= self.plain_left, "plain bits end too early")
        value = self.plain & ((1 << count) - 1)
        self.plain >>= count
        self.plain_left -= count
        return value

    def token(self, model):
        need(not self.empty, "a value from an empty stream")
        if model.until_update == 0:
            model.update()
        x = self.states[self.turn]
        token, cumulative, frequency = model.slots[x % 4096]
        x = frequency * (x // 4096) + x % 4096 - cumulative
        if x < 65536:
            word = next(self.words, None)
            need(word is not None, "words end too early")
            x = x * 65536 + word
        self.states[self.turn] = x
        self.turn = 1 - self.turn
        model.counts[token] += 32
        model.until_update -= 1
        return token

    def value(self, model):
        token = self.token(model)
        if token == ESCAPE:
            token = self.bits(8)
            if token == 255:
                return int32(self.bits(32))
            need(token < ESCAPE, "an escape to no token")
            model.counts[token] += 32
            model.until_update //= 2
        value, direction, s = TOKENS[token]
        return value + direction * self.bits(s)

    def finish(self):
        need(self.empty or self.states == [65536, 65536] and next(self.words, None) is None
             and self.plain_left < 8 and self.plain == 0, "a stream does not end where its values do")
