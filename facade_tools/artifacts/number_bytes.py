"""Canonical JSON of numbers in compiled loops: the bytes of `numbers.dump_line`, without Python.

Twelve significant digits, correctly rounded: the product of a number and a power of ten is taken
with its exact error (Dekker 1971), so that halves are seen as halves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .numbers import SIGNIFICANT_DIGITS, dump_line

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

LONGEST = 20  # bytes of room that `write_number` needs
LEAST, MOST = (
    1e-11,
    999_999_999_999.0,
)  # between them powers of ten are exact that scale to 12 digits
POWERS = 10.0 ** np.arange(23)
INVERSE = 10.0 ** -np.arange(12.0)
FULL = 10**SIGNIFICANT_DIGITS
SPLITTER = 2.0**27 + 1.0
ZERO, DOT, MINUS, E = 48, 46, 45, 101  # ASCII
THREES = np.array([list(b"%03d" % i) for i in range(1000)], dtype=np.uint8)


def plain_size(values: Floats) -> NDArray[np.bool_]:
    """Tell which numbers `write_number` can write; the rest are written by `numbers`."""
    size = np.abs(values)
    return np.asarray((size == 0) | ((size >= LEAST) & (size < MOST)))


def text_of(value: float) -> bytes:
    """Return the canonical JSON of any finite number. Raises ValueError on the others.

    >>> text_of(-0.0), text_of(1e22 / 3)
    (b'0.0', b'3.33333333333e+21')
    """
    return dump_line(float(value))[:-1]


@compiled
def _halves(x: float) -> tuple[float, float]:
    big = SPLITTER * x
    high = big - (big - x)
    return high, x - high


@compiled
def product_error(x: float, y: float, product: float) -> float:
    """Return x·y − product exactly."""
    a, b = _halves(x)
    c, d = _halves(y)
    return ((a * c - product) + a * d + b * c) + b * d


@compiled
def decimal_exponent(size: float) -> int:
    """Return e with 10^e ≤ size < 10^(e+1), from −11 to 11."""
    e = 0
    if size >= 1.0:
        while e < 11 and size >= POWERS[e + 1]:
            e += 1
        return e
    while e < 11 and size < INVERSE[e]:
        e += 1
    return -e


@compiled
def rounded_digits(size: float, e: int) -> int:
    """Return size·10^(11−e) rounded to an integer, halves to even."""
    scale = POWERS[11 - e]
    product = size * scale
    whole = np.floor(product)
    n = int(whole)
    over = ((product - whole) - 0.5) + product_error(size, scale, product)
    if over > 0.0 or (over == 0.0 and n % 2 == 1):
        n += 1
    return n


@compiled
def write_number(value: float, out: Bytes, at: int) -> int:
    """Write the canonical JSON of a number of plain size from `at` on; return where it ends.

    `out` needs room for `LONGEST` bytes.
    """
    if value < 0.0:
        out[at] = MINUS
        at += 1
    if value == 0.0:
        out[at], out[at + 1], out[at + 2] = ZERO, DOT, ZERO
        return at + 3
    e = decimal_exponent(abs(value))
    digits = rounded_digits(abs(value), e)
    if digits == FULL:
        digits, e = FULL // 10, e + 1
    first = at + 1 - e if -5 < e < 0 else at + 1
    write_digits(digits, out, first)
    count = SIGNIFICANT_DIGITS
    while count > 1 and out[first + count - 1] == ZERO:
        count -= 1
    if e >= 0:
        return _pointed(out, at, e, count)
    if e > -5:
        for i in range(at, first):
            out[i] = ZERO
        out[at + 1] = DOT
        return first + count
    return _with_exponent(out, at, e, count)


@compiled
def write_digits(digits: int, out: Bytes, at: int) -> None:
    """Write an integer of twelve digits."""
    high = digits // 1_000_000
    low = digits - high * 1_000_000
    for part in (high, low):
        thousands = part // 1000
        for three in (thousands, part - thousands * 1000):
            for i in range(3):
                out[at + i] = THREES[three, i]
            at += 3


@compiled
def _pointed(out: Bytes, at: int, e: int, count: int) -> int:
    """Put the point after digit e of the digits that stand from at + 1 on."""
    for i in range(at, at + e + 1):
        out[i] = out[i + 1]
    out[at + e + 1] = DOT
    if count <= e + 1:
        out[at + e + 2] = ZERO
        count = e + 2
    return at + 1 + count


@compiled
def _with_exponent(out: Bytes, at: int, e: int, count: int) -> int:
    """Turn the digits that stand from at + 1 on into d.ddde-0e."""
    out[at] = out[at + 1]
    out[at + 1] = DOT
    at += 1 + count if count > 1 else 1
    out[at], out[at + 1] = E, MINUS
    out[at + 2], out[at + 3] = ZERO + (-e) // 10, ZERO + (-e) % 10
    return at + 4
