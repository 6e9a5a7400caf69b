"""Random numbers, and functions of them, with the same bits on every machine.

Exponentials and sines of C libraries and of NumPy's vector code differ in the last bit from machine
to machine, which changes where a robot falls. Sums and products don't differ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Arguments are divided by 2^HALVINGS for the series, and the results squared as often.
HALVINGS = 8
TERMS = 8

#: Normal numbers are rounded to multiples of its inverse, because their tails are computed by a
#: logarithm, whose last bit may differ.
GRID = 2.0**32


def normal(rng: np.random.Generator, shape: int | tuple[int, ...]) -> NDArray[np.float64]:
    """Draw standard normal numbers, on a grid of 2^-32."""
    return np.rint(rng.standard_normal(shape) * GRID) / GRID


def exp(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return e^x, to a relative error of about 1e-13 for |x| up to 8."""
    small = x / 2.0**HALVINGS
    total = np.ones_like(small)
    for term in range(TERMS, 0, -1):
        total = 1 + small / term * total
    for _ in range(HALVINGS):
        total = total * total
    return total


def cos_sin(angle: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cosine and sine of an angle in radians, to about 1e-13 for angles up to 8."""
    small = angle / 2.0**HALVINGS
    square = small * small
    cosine, sine = np.ones_like(small), np.ones_like(small)
    for term in range(2 * TERMS, 0, -2):
        cosine = 1 - square / (term * (term - 1)) * cosine
        sine = 1 - square / (term * (term + 1)) * sine
    sine = small * sine
    for _ in range(HALVINGS):
        cosine, sine = cosine * cosine - sine * sine, 2 * cosine * sine
    return cosine, sine


def direction(rng: np.random.Generator, k: int) -> NDArray[np.float64]:
    """Draw unit vectors of the plane, uniformly distributed, shape (2, k)."""
    vector = normal(rng, (2, k))
    length = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1])
    return np.where(length > 0, vector / np.where(length > 0, length, 1.0), 0.0)
