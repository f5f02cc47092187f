"""Tracks of RTPCA in docs/FORMAT.md: levels of three axes over the frames; a part of independent_decoder.py."""

import math

import numpy as np

from independent_bending import PI, unit_vector
from independent_mixed import MixedInteger, ShortNumber, class_of, half_class_of, magnitude_of
from independent_streams import int32
from independent_transform import inverse_cosine_transforms

SQRT2 = 1.41421356237309504880
BANDS = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192]
AT_ONCE = 5  # tracks that are transformed together


def cut(frame_count, form):
    """Begin and end of the blocks of a track."""
    size = 8 << (form - 2)
    count = max(1, (frame_count + size // 2) // size)
    starts = [b * frame_count // count for b in range(count + 1)]
    return list(zip(starts, starts[1:]))


def end_of(levels, n):
    """Where a block of these levels ends, as the mean of a block of n frames."""
    m = len(levels)
    turn, end = PI / (2.0 * m), float(levels[0])
    for j in range(1, m):
        if levels[j]:
            c = unit_vector(turn * j)[0]
            end = end + (-c if j % 2 else c) * SQRT2 * levels[j]
    return min(max(math.floor(end * math.sqrt(n / m) + 0.5), -2**30), 2**30)


class TrackCoder:
    def __init__(self, frame_count):
        self.frame_count, self.form = frame_count, ShortNumber(3)
        self.stepped = MixedInteger([72, 144, 144, 96])
        self.means = MixedInteger([192, 32])
        self.transformed = MixedInteger([72, 144, 128, 96, 192])

    def code(self, stream, rank):
        """Form, and levels of the three axes."""
        form, rank = self.form.code(stream), min(rank, 3)
        return form, self.code_steps(stream, form, rank) if form < 2 else self.code_blocks(stream, form, rank)

    def code_steps(self, stream, form, rank):
        levels = [[], [], []]
        latest, mean = [[0] * 4 for _ in range(3)], [0] * 3
        for f in range(self.frame_count):
            for axis, x in enumerate(levels):
                m = latest[axis]
                near = 7 * m[0] + 5 * m[1] + 3 * m[2] + m[3]
                beside = 8 * sum(latest[a][0] for a in range(3) if a != axis)
                r = self.stepped.code(stream, (
                    3 * class_of(24 * near + 8 * beside) + axis,
                    12 * half_class_of(32 * near) + half_class_of(32 * beside),
                    12 * half_class_of(512 * m[0]) + half_class_of(512 * m[1]),
                    4 * class_of(32 * mean[axis]) + rank))
                prediction = 0 if f == 0 else x[f - 1] if form == 0 or f == 1 else int32(2 * x[f - 1] - x[f - 2])
                x.append(int32(r + prediction))
                size = magnitude_of(r)
                mean[axis] += (16 * size - mean[axis] + 4) // 8
                latest[axis] = [size, *m[:3]]
        return levels

    def code_blocks(self, stream, form, rank):
        levels = [[], [], []]
        first = mean = 0
        before = None  # begin and end of the block before
        q = [[], [], []]
        for begin, end in cut(self.frame_count, form):
            n = end - begin
            p = [[0] * (n + 6) for _ in range(3)]  # from frequency -5 on
            q = [[0, *sizes, *[0] * (n + 2)] for sizes in q]  # from frequency -1 on
            for axis in range(3):
                r = self.means.code(stream, (8 * (class_of(32 * first + 16) if before else 0) + form, 8 * rank + form))
                prediction = end_of(levels[axis][slice(*before)], n) if before else 0
                levels[axis].append(int32(r + prediction))
                p[axis][5] = magnitude_of(r)
                first += (16 * p[axis][5] - first + 2) // 4
            for j in range(1, n):
                t = 256 * j // n
                band = sum(bound <= t for bound in BANDS)
                for axis in range(3):
                    s = p[axis]
                    past = 6 * s[j + 4] + 4 * s[j + 3] + 3 * s[j + 2] + 2 * s[j + 1] + s[j]
                    if axis == 0:
                        beside = 8 * (p[1][j + 4] + p[2][j + 4])
                    elif axis == 1:
                        beside = 10 * p[0][j + 5] + 6 * p[2][j + 4]
                    else:
                        beside = 8 * (p[0][j + 5] + p[1][j + 5])
                    earlier = 8 * q[axis][j + 1] + 4 * (q[axis][j] + q[axis][j + 2])
                    expected = 12 * past + 4 * beside + 16 * earlier if before else 24 * past + 8 * beside
                    level = self.transformed.code(stream, (
                        3 * class_of(expected) + axis,
                        12 * half_class_of(32 * earlier) + half_class_of(32 * past),
                        8 * band + form,
                        4 * class_of(32 * mean) + rank,
                        16 * half_class_of(32 * beside) + band))
                    levels[axis].append(level)
                    s[j + 5] = magnitude_of(level)
                    mean += (16 * s[j + 5] - mean + 4) // 8
            before, q = (begin, end), [sizes[5:5 + n] for sizes in p]
        return levels


def values_of(tracks):
    """Values [F,3], float32, of tracks (form, levels) that are transformed together."""
    values = [np.array(levels, np.float32).T for _, levels in tracks]
    for form in range(2, 8):
        alike = [k for k, track in enumerate(tracks) if track[0] == form]
        for at in range(0, len(alike), AT_ONCE):
            chosen = alike[at:at + AT_ONCE]
            signals = np.zeros((len(values[chosen[0]]), 16), np.float32)
            for t, k in enumerate(chosen):
                signals[:, 3 * t:3 * t + 3] = values[k]
            for begin, end in cut(len(signals), form):
                x, y = inverse_cosine_transforms(signals[begin:end, :8], signals[begin:end, 8:])
                signals[begin:end] = np.concatenate([x, y], axis=1)
            for t, k in enumerate(chosen):
                values[k] = signals[:, 3 * t:3 * t + 3]
    return values
