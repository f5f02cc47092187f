"""Curves of rate over error: lower envelopes, and comparisons of two of them, interpolated in logarithms.

A curve is a list of (error, rate, row) from the smallest error on, each rate smaller than all before: at each error the smallest
rate that reaches it.
"""
import math

import numpy as np


def envelope(rows, error="kg", rate="bpvf"):
    """The curve of rows of a table; those without an error cannot stand on a logarithmic axis and are left out."""
    points = sorted(((float(row[error]), float(row[rate]), row) for row in rows if float(row[error]) > 0), key=lambda p: p[:2])
    best, kept = math.inf, []
    for point in points:
        if point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


def logs(curve):
    return [math.log(point[0]) for point in curve], [math.log(point[1]) for point in curve]


def rate_at(curve, error):
    """Rate of a curve at an error; None beyond its ends."""
    if not curve or not curve[0][0] <= error <= curve[-1][0]:
        return None
    return math.exp(np.interp(math.log(error), *logs(curve)))


def error_at(curve, rate):
    """Error of a curve at a rate; None beyond its ends."""
    if not curve or not curve[-1][1] <= rate <= curve[0][1]:
        return None
    errors, rates = logs(curve)
    return math.exp(np.interp(math.log(rate), rates[::-1], errors[::-1]))


def common_range(*curves):
    """Errors that all curves cover, from and to; None without any."""
    if any(len(curve) < 2 for curve in curves):
        return None
    low, high = max(curve[0][0] for curve in curves), min(curve[-1][0] for curve in curves)
    return (low, high) if low < high else None


def log_ratios(a, b):
    """Logarithms of a's rate over b's at 200 errors that both cover, evenly in logarithms; None without a common range."""
    span = common_range(a, b)
    if not span:
        return None
    grid = np.linspace(math.log(span[0]), math.log(span[1]), 200)
    return np.interp(grid, *logs(a)) - np.interp(grid, *logs(b))


def difference(a, b):
    """Mean rate of curve a over that of b at equal error (Bjontegaard), in percent (negative: a is smaller); None likewise."""
    ratios = log_ratios(a, b)
    return None if ratios is None else 100 * (math.exp(ratios.mean()) - 1)


def gains(a, b):
    """What a saves against b at equal error in percent: most, mean, least, and the errors from and to; None likewise."""
    ratios = log_ratios(a, b)
    if ratios is None:
        return None
    saved = lambda ratio: 100 * (1 - math.exp(ratio))
    return (saved(ratios.min()), saved(ratios.mean()), saved(ratios.max()), *common_range(a, b))


def swapped(curve):
    """Errors for rates and rates for errors, so that what compares at equal error compares at equal rate."""
    return [(rate, error, row) for error, rate, row in reversed(curve)]
