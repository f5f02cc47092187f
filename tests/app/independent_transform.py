"""The inverse cosine transform of docs/FORMAT.md, bit by bit; a part of independent_decoder.py. Complex numbers are
pairs of float32, or of arrays of them, so that each operation of their parts is rounded by itself. Signals stand in
the columns of arrays."""

import math
from functools import lru_cache

import numpy as np

from independent_bending import unit_vector
from independent_streams import crc32c, need

PI = 3.14159265358979323846
single = np.float32


def add(z, w):
    return z[0] + w[0], z[1] + w[1]


def subtract(z, w):
    return z[0] - w[0], z[1] - w[1]


def multiply(z, w):
    return z[0] * w[0] - z[1] * w[1], z[0] * w[1] + z[1] * w[0]


def scale(z, factor):
    return z[0] * factor, z[1] * factor


def conjugate(z):
    return z[0], -z[1]


def times_minus_i(z):
    return z[1], -z[0]


@lru_cache(maxsize=None)
def root(p, q):
    c, s = unit_vector(2.0 * PI * (p / q))
    return single(c), single(-s)


def roots(numerators, q, further):
    """Of shape [numerators,1 …], with `further` ones."""
    found = np.array([root(p, q) for p in numerators], single).reshape(-1, 2, *[1] * further)
    return found[:, 0], found[:, 1]


def split(n, primes):
    """The primes that n is made of, in their order, and what is left of it."""
    found = []
    for p in primes:
        while n % p == 0:
            found.append(p)
            n //= p
    return found, n


def butterfly(u, n):
    """The v of one pass from its u; root numbers are those of a transform of n."""
    radix = len(u)
    if radix == 2:
        return [add(u[0], u[1]), subtract(u[0], u[1])]
    if radix == 4:
        even, odd = add(u[0], u[2]), subtract(u[0], u[2])
        other, side = add(u[1], u[3]), times_minus_i(subtract(u[1], u[3]))
        return [add(even, other), add(odd, side), subtract(even, other), subtract(odd, side)]
    if radix == 3:
        total = add(u[1], u[2])
        middle = subtract(u[0], scale(total, single(0.5)))
        side = scale(times_minus_i(subtract(u[1], u[2])), single(0.8660254037844386))
        return [add(u[0], total), add(middle, side), subtract(middle, side)]
    half = range(1, (radix - 1) // 2 + 1)
    s = {k: add(u[k], u[radix - k]) for k in half}
    d = {k: times_minus_i(subtract(u[k], u[radix - k])) for k in half}
    v = [u[0]] + [None] * (radix - 1)
    for k in half:
        v[0] = add(v[0], s[k])
    for l in half:
        even, odd = u[0], scale(u[0], single(0))
        for k in half:
            c, minus_sine = root(k * l % radix * n // radix, n)
            even, odd = add(even, scale(s[k], c)), add(odd, scale(d[k], -minus_sine))
        v[l], v[radix - l] = add(even, odd), subtract(even, odd)
    return v


def pass_radices(z, radices):
    n, *signals = z[0].shape
    rest, done = n, 1
    for radix in radices:
        parts = rest // radix
        u = [tuple(part.reshape(radix, parts, done, *signals)[k] for part in z) for k in range(radix)]
        out = np.empty((2, parts, radix, done, *signals), single)
        for l, v in enumerate(butterfly(u, n)):
            if l:
                turned = multiply(v, roots([l * j * done for j in range(parts)], n, 1 + len(signals)))
                v = tuple(np.concatenate([whole[:1], part[1:]]) for whole, part in zip(v, turned))
            out[0, :, l], out[1, :, l] = v
        z = out[0].reshape(n, *signals), out[1].reshape(n, *signals)
        rest, done = parts, done * radix
    return z


ODD_PRIMES = [p for p in range(3, 44, 2) if all(p % q for q in range(3, p, 2))]


def fourier(z):
    n, *signals = z[0].shape
    radices, left = split(n, [4, 2, *ODD_PRIMES])
    if left == 1:
        return pass_radices(z, radices)
    m = 2 * n - 1
    while split(m, [2, 3, 5])[1] != 1:
        m += 1
    chirp = roots([k * k % (2 * n) for k in range(n)], 2 * n, len(signals))
    folded = np.zeros((2, m, *[1] * len(signals)), single)
    for part, values in zip(folded, scale(conjugate(chirp), single(1.0 / m))):
        part[:n] = values
        part[m - n + 1:] = values[:0:-1]
    spread = np.zeros((2, m, *signals), single)
    spread[:, :n] = multiply(z, chirp)
    y = multiply(fourier(tuple(spread)), fourier(tuple(folded)))
    y = conjugate(fourier(conjugate(y)))
    return multiply((y[0][:n], y[1][:n]), chirp)


def unfold(values):
    result = np.empty_like(values)
    half = (len(values) + 1) // 2
    result[0::2] = values[:half]
    result[1::2] = values[half:][::-1]
    return result


def inverse_cosine_transforms(x, y=None):
    """Of float32 [n] or [n,signals]; with y, of both, a signal of x together with one of y."""
    n = len(x)
    z = np.zeros((2, *x.shape), single)
    first, factor = single(1.0 / math.sqrt(n)), single(math.sqrt(2.0) / math.sqrt(n) * 0.5)
    z[0, 0] = x[0] * first
    if y is not None:
        z[1, 0] = -(y[0] * first)
    for k in range(1, n // 2 + 1):
        c, d = scale(root(k, 4 * n), factor)
        p, q = multiply((x[k], -x[n - k]), (c, -d))
        if y is None:
            z[:, k] = p, -q
            z[:, n - k] = p, q
        else:
            u, v = multiply((y[k], -y[n - k]), (c, -d))
            z[:, k] = p - v, -(q + u)
            z[:, n - k] = p + v, q - u
    real, imaginary = fourier(tuple(z))
    return unfold(real) if y is None else (unfold(real), unfold(-imaginary))


def check_transform():
    """The checksum that docs/FORMAT.md gives."""
    results = b""
    for n in range(1, 131):
        x = np.array([(k * k + 3 * k + n) % 29 - 14 for k in range(n)], single)
        results += (inverse_cosine_transforms(x) + single(0)).tobytes()  # -0 becomes 0
    need(crc32c(results) == 0x71E4F45A, "the bits of the transform differ")
    print(f"{'transform':<24} 130 lengths alike")
