"""Local polynomials in one window in exact arithmetic: whole numbers and fractions, rounded once at the end.

Samples are binary fractions, and Gram polynomials have rational values on a uniform grid, so nothing need ever be rounded.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from math import lcm, log

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Grid:
    """Polynomials of rising degree that are orthogonal on the positions -half … half, scaled to whole numbers."""

    def __init__(self, half: int, highest: int) -> None:
        m = 2 * half + 1
        positions = range(-half, half + 1)
        # P_{j+1}(k) = k P_j - β_j P_{j-1}, and the same differentiated d times at the centre.
        before, here = [Fraction(0)] * m, [Fraction(1)] * m
        before_centre = [Fraction(0)] * (highest + 1)
        centre = [Fraction(1)] + [Fraction(0)] * highest
        self.values: list[list[int]] = []
        """Value of every polynomial at every position."""
        self.centre: list[list[int]] = []
        """Derivatives of every polynomial at the centre, its value first."""
        for j in range(highest + 1):
            scale = lcm(*(value.denominator for value in here), *(value.denominator for value in centre))
            self.values.append([int(value * scale) for value in here])
            self.centre.append([int(value * scale) for value in centre])
            beta = Fraction(j * j * (m * m - j * j), 4 * (4 * j * j - 1))
            following = [k * value - beta * old for k, value, old in zip(positions, here, before, strict=True)]
            derived = [
                (d * centre[d - 1] if d else 0) - beta * old
                for d, old in zip(range(highest + 1), before_centre, strict=True)
            ]
            before, here, before_centre, centre = here, following, centre, [Fraction(value) for value in derived]
        self.norms = [sum(value * value for value in values) for values in self.values]
        """Squared norm of every polynomial."""


@lru_cache(maxsize=8)
def grid(half: int, highest: int) -> Grid:
    """Return the polynomials, made once."""
    return Grid(half, highest)


def gains(half: int, highest: int) -> Array:
    """Return what every orthonormal polynomial adds to the derivatives at the centre: one row a derivative, one column a degree."""
    polynomials = grid(half, highest)
    columns = [
        [float(Fraction(value * value, norm)) ** 0.5 * (1 if value >= 0 else -1) for value in centre]
        for centre, norm in zip(polynomials.centre, polynomials.norms, strict=True)
    ]
    return np.array(columns).T


class Window:
    """Every order's fit of one window with a sample at its centre."""

    def __init__(self, samples: npt.ArrayLike, highest: int) -> None:
        ratios: list[tuple[int, int]] = [
            value.as_integer_ratio() for value in np.asarray(samples, dtype=np.float64).tolist()
        ]
        half = len(ratios) // 2
        # Denominators of doubles are powers of two, so the largest is a multiple of all.
        self._unit = max(denominator for _, denominator in ratios)
        exact = [numerator * (self._unit // denominator) for numerator, denominator in ratios]
        self._level = Fraction(exact[half], self._unit)
        self._grid = grid(half, highest)
        rest = [value - exact[half] for value in exact]
        self._energy = sum(value * value for value in rest)
        self._products = [
            sum(p * value for p, value in zip(polynomial, rest, strict=True)) for polynomial in self._grid.values
        ]

    def coefficients(self) -> Array:
        """Return the coefficients of the orthonormal polynomials, the sample at the centre taken off beforehand."""
        pairs = zip(self._products, self._grid.norms, strict=True)
        squares = [Fraction(product * product, norm) / self._unit**2 for product, norm in pairs]
        return np.copysign(np.sqrt([float(square) for square in squares]), [float(p) for p in self._products])

    def derivative(self, order: int, d: int) -> Fraction:
        """Return the d-th derivative at the centre of the polynomial of an order, per sample period to the power of d."""
        total = Fraction(0)
        for j in range(order + 1):
            total += Fraction(self._products[j] * self._grid.centre[j][d], self._grid.norms[j])
        return total / self._unit + (self._level if d == 0 else 0)

    def rss(self, order: int) -> Fraction:
        """Return the residual sum of squares of an order."""
        rest = Fraction(self._energy)
        for j in range(order + 1):
            rest -= Fraction(self._products[j] ** 2, self._grid.norms[j])
        return rest / self._unit**2

    def score(self, order: int) -> float:
        """Return the criterion (8) of an order; rounded where the logarithm is taken."""
        m, k = len(self._grid.values[0]), order + 1
        return m * log(self.rss(order) / (m - 1)) + 2 * k + 2 * k * (k + 1) / (m - k - 1)
