"""Expanded coefficients in slow NumPy: integrals of products in weak form, and generalised least squares with dense matrices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

Array = npt.NDArray[np.float64]


def product_column(
    angle: Array, coefficient: Polynomial, derivative: int, half: int, exponent: int, period: float
) -> Array:
    """Return ⟨φ c θ^(d)⟩ at every possible centre, d times integrated by parts: (-1)^d ⟨(φ c)^(d) θ⟩, the product as one polynomial."""
    seconds = half * period
    found = np.empty(angle.size - 2 * half)
    for row in range(found.size):
        centre = (row + half) * period
        shape = Polynomial([1, 0, -1]) ** exponent
        # Both as polynomials of x, the place within the window.
        inside = coefficient(Polynomial([centre, seconds]))
        product = (shape * inside).deriv(derivative) if derivative else shape * inside
        x = np.arange(-half, half + 1) / half
        weights = (-1) ** derivative * product(x) / seconds**derivative
        found[row] = np.sum(weights * angle[row : row + 2 * half + 1])
    return found / np.sum((1 - (np.arange(-half, half + 1) / half) ** 2) ** exponent)


def generalised(design: Array, rhs: Array, covariance: Array) -> tuple[Array, Array, float]:
    """Return the solution of generalised least squares, its covariance and the misfit."""
    inverse = np.linalg.inv(covariance)
    normal = np.linalg.inv(design.T @ inverse @ design)
    values = normal @ (design.T @ (inverse @ rhs))
    left = rhs - design @ values
    return values, np.asarray(normal, np.float64), float(left @ inverse @ left)
