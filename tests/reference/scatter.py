"""By what standard errors of ordinary least squares are too small where rows come from windows that overlap."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from reference.regression import solve

Array = npt.NDArray[np.float64]


def scatter(values: Array, errors: Array, window: int, half: int) -> Array | None:
    """Compare windows that share no row by second differences; None where the record is too short. One column an unknown."""
    n = len(values)
    first, end = half + window // 2, n - half + window // 2 + 1 - window
    distance = -(-(window + half) // 8) * 8  # a multiple of the eight differences that begin within it
    if end - first < 3 * distance:
        return None
    factors = []
    for x, error in zip(values.T, errors.T, strict=True):
        squares = []
        for i in range(first + distance, end - distance, distance // 8):
            difference = x[i] - (x[i - distance] + x[i + distance]) / 2
            variance = error[i] ** 2 + (error[i - distance] ** 2 + error[i + distance] ** 2) / 4
            squares.append(difference**2 / variance)
        squares = sorted(square for square in squares if np.isfinite(square))
        if not squares:
            return None
        most = 25 * squares[len(squares) // 2] / 0.454936
        factors.append(max(1.0, float(np.sqrt(np.mean(np.minimum(squares, most))))))
    return np.array(factors)


def variance_inflation(A: Array, b: Array, reach: int) -> Array:
    """Compare the covariance of least squares whose residuals are correlated with that of independent ones."""
    usable = np.isfinite(A).all(axis=1) & np.isfinite(b)
    solution = solve(A[usable], b[usable])
    X, e = np.zeros_like(A), np.zeros_like(b)
    X[usable] = A[usable]
    e[usable] = b[usable] - A[usable] @ solution.params
    n = len(b)
    by_lag = np.zeros(n)
    for lag in range(min(reach + 1, n)):
        pairs = max(int(np.sum(usable[lag:] & usable[: n - lag])), 1)
        by_lag[lag] = (1 - lag / (reach + 1)) * (e[lag:] @ e[: n - lag]) / pairs
    covariance = by_lag[np.abs(np.subtract.outer(np.arange(n), np.arange(n)))]
    inverse = solution.covariance / (solution.rss / (usable.sum() - A.shape[1]))
    honest = np.diag(inverse @ X.T @ covariance @ X @ inverse)
    return np.asarray(np.sqrt(np.maximum(1.0, honest / (covariance[0, 0] * np.diag(inverse)))))
