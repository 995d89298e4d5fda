"""Least squares in windows: equations (3) and (4)."""

from __future__ import annotations

from collections.abc import Sequence
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


@dataclass
class Solutions:
    """Least squares of many windows, one after another; NaN and no rows where there is nothing."""

    params: Array
    """(window, unknown)."""
    stderr: Array
    rss: Array
    condition: Array
    rows: npt.NDArray[np.int64]
    """Rows that a window holds."""
    covariance: Array
    """(window, unknown, unknown)."""

    def one(self, place: int) -> Solution | None:
        """Give one window's."""
        if not self.rows[place]:
            return None
        return Solution(
            self.params[place],
            self.stderr[place],
            float(self.rss[place]),
            float(self.condition[place]),
            int(self.rows[place]),
            self.covariance[place],
        )


def window_rows(i: int, w: int, n: int, alignment: str = "centre") -> slice:
    """Give the rows of the window of row i, shrunk at the ends."""
    first = i - {"centre": w // 2, "trailing": w - 1, "leading": 0}[alignment]
    return slice(max(0, first), min(n, first + w))


def solve_fading(A: Array, b: Array, noise: Array, fading: Array) -> tuple[Array, Array, float, float]:
    """Solve one window with weights of noise and of age by normal equations: parameters, standard errors, RSS, R² around zero."""
    normal = (A * (noise * fading)[:, None]).T @ A
    middle = (A * (noise * fading**2)[:, None]).T @ A
    inverse = np.linalg.inv(normal)
    x = inverse @ (A.T @ (noise * fading * b))
    rss = float(np.sum(noise * fading * (b - A @ x) ** 2))
    variance = rss / (fading.sum() - np.trace(inverse @ middle))
    error = np.sqrt(variance * np.diagonal(inverse @ middle @ inverse))
    return x, error, rss, 1 - rss / float(np.sum(noise * fading * b**2))


def solve(A: Array, b: Array) -> Solution:
    """Solve one window."""
    solution = solve_windows(A, b, [np.arange(b.size)]).one(0)
    assert solution is not None, "rows that determine the unknowns"
    return solution


def solve_windows(A: Array, b: Array, windows: Sequence[npt.NDArray[np.intp]]) -> Solutions:
    """Solve windows of some rows by NumPy's QR decomposition, columns scaled to the same norm.

    There is nothing where the rows are no more than the unknowns, or do not determine them. Windows of one size are decomposed together.
    """
    p, count = A.shape[1], len(windows)
    held = np.array([rows.size for rows in windows])
    found = Solutions(
        np.full((count, p), np.nan),
        np.full((count, p), np.nan),
        np.full(count, np.nan),
        np.full(count, np.nan),
        np.zeros(count, dtype=np.int64),
        np.full((count, p, p), np.nan),
    )
    for size in np.unique(held[held > p]):
        places = np.flatnonzero(held == size)
        of = np.array([windows[place] for place in places.tolist()])
        columns = A[of]
        norms = np.maximum(np.linalg.norm(columns, axis=1), np.finfo(np.float64).tiny)
        columns = columns / norms[:, None]
        whole = np.linalg.matrix_rank(columns) == p
        places, of, columns, norms = places[whole], of[whole], columns[whole], norms[whole]
        q, r = np.linalg.qr(columns)
        inverse = np.linalg.inv(r)
        x = (inverse @ (q.transpose(0, 2, 1) @ b[of][:, :, None]))[:, :, 0]
        residuals = b[of] - (columns @ x[:, :, None])[:, :, 0]
        rss = np.sum(residuals**2, axis=1)
        variance = rss / (size - p)
        between = norms[:, :, None] * norms[:, None, :]
        covariance = inverse @ inverse.transpose(0, 2, 1) * variance[:, None, None] / between
        found.params[places] = x / norms
        found.stderr[places] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        found.rss[places] = rss
        found.condition[places] = np.sqrt(p) * np.linalg.norm(inverse, axis=(1, 2))
        found.rows[places] = size
        found.covariance[places] = covariance
    return found
