"""Least squares in windows: equations (3) and (4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass
class Solution:
    """One window's least squares."""

    params: Array
    stderr: Array
    rss: float
    condition: float
    rows: int
    covariance: Array


def window_rows(i: int, w: int, n: int) -> slice:
    """Give the rows of the window around row i, shrunk at the ends."""
    return slice(max(0, i - w // 2), min(n, i - w // 2 + w))


def solve(A: Array, b: Array) -> Solution:
    """Solve one window by NumPy's orthogonal least squares, columns scaled to the same norm."""
    rows, p = A.shape
    norms = np.linalg.norm(A, axis=0)
    scaled = A / norms
    x, *_ = np.linalg.lstsq(scaled, b, rcond=None)
    residuals = b - scaled @ x
    rss = float(residuals @ residuals)
    _, r = np.linalg.qr(scaled)
    inverse = np.linalg.inv(r)
    covariance = inverse @ inverse.T * (rss / (rows - p) if rows > p else np.nan) / np.outer(norms, norms)
    condition = float(np.sqrt(p) * np.linalg.norm(inverse))
    return Solution(x / norms, np.sqrt(np.diag(covariance)), rss, condition, rows, covariance)
