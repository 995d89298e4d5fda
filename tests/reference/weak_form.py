"""The weak form written slowly in NumPy: rows of a test function, and constants from windows one by one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

Array = npt.NDArray[np.float64]


def kernels(half: int, exponent: int, delta: float, shift: float = 0.0) -> Array:
    """Give φ″, -φ′ and φ at the samples, scaled so that φ, where it is not shifted, sums to one, each exact for constants."""
    phi = Polynomial([1, 0, -1]) ** exponent
    x = (np.arange(-half, half + 1) - shift) / half
    inside = np.abs(x) <= 1
    total = phi(np.arange(-half, half + 1) / half).sum()
    second = half * delta
    rows = np.array([phi.deriv(2)(x) / second**2, -phi.deriv(1)(x) / second, phi(x)]) * inside / total
    # What each kernel makes of a constant: only φ leaves it.
    wanted = np.array([0.0, 0.0, 1.0])
    return np.asarray(rows + np.outer(wanted - rows.sum(axis=1), rows[2] / rows[2].sum()))


def stride_of(half: int) -> int:
    """Give the samples from one row to the next: a sixth of the half-width, or one more instead of more than eight rows to it."""
    stride = max(1, half // 6)
    return stride + 1 if half > 8 * stride and half >= 5.5 * (stride + 1) else stride


def rows(angle: Array, torque: Array, half: int, exponent: int, delta: float, lag: float = 0.0) -> tuple[Array, Array]:
    """Give the regressors of inertia, damping and stiffness and the right-hand side, NaN where a window does not fit."""
    stride = stride_of(half)
    kernel = kernels(half, exponent, delta)
    whole = int(np.rint(lag))
    late = kernels(half, exponent, delta, lag - whole)[2]
    centres = range(half, angle.size - half, stride)
    A, b = np.full((len(centres), 3), np.nan), np.full(len(centres), np.nan)
    for row, centre in enumerate(centres):
        A[row] = kernel @ angle[centre - half : centre + half + 1]
        first = centre - half + whole
        if first >= 0 and first + 2 * half + 1 <= torque.size:
            b[row] = late @ torque[first : first + 2 * half + 1]
    return A, b


def roots(weights: Array, half: int, exponent: int, delta: float, lag: float = 0.0) -> Array:
    """Give what rows are multiplied by where the variance of a sample's noise is one over its weight: one over their deviation."""
    whole = int(np.rint(lag))
    squares = kernels(half, exponent, delta, lag - whole)[2] ** 2
    found = []
    for centre in range(half, weights.size - half, stride_of(half)):
        inside = weights[max(0, centre - half + whole) : centre + half + 1 + whole]
        found.append(np.sqrt(squares.sum() / (squares / inside).sum()) if inside.size == squares.size else np.nan)
    return np.array(found)


def profile(windowed: Array, constant: Array, b: Array, window: int, step: int) -> Array:
    """Give the constants that are best for all windows of rows together, each window with unknowns of its own."""
    normal, side = np.zeros(2 * (constant.shape[1],)), np.zeros(constant.shape[1])
    for first in range(0, b.size - window + 1, step):
        rows_of = slice(first, first + window)
        Q, _ = np.linalg.qr(windowed[rows_of])
        left = constant[rows_of] - Q @ (Q.T @ constant[rows_of])
        normal, side = normal + left.T @ left, side + left.T @ b[rows_of]
    return np.asarray(np.linalg.solve(normal, side))


def companion_kernels(half: int, exponent: int, delta: float) -> Array:
    """Give the kernels of coefficients that grow in proportion to the time τ from the centre: (τφ)″, -(τφ)′ and τφ, exact for constants."""
    phi = Polynomial([1, 0, -1]) ** exponent
    grows = Polynomial([0, 1]) * phi
    x = np.arange(-half, half + 1) / half
    second = half * delta
    total = phi(x).sum()
    rows = np.array([grows.deriv(2)(x) / second, -grows.deriv(1)(x), second * grows(x)]) / total
    return np.asarray(rows - np.outer(rows.sum(axis=1), phi(x)) / total)
