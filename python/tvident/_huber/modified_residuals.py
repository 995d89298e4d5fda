"""Right-hand sides whose least squares in windows are those of Huber's loss: residuals beyond a limit count linearly."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

LIMIT = 1.345
"""Standard deviations from which residuals count linearly: 95 % of the efficiency of least squares where noise is normal (Huber 1981)."""

_MEDIAN = 0.6744897501960817
"""Half of normal deviations are smaller than this part of the standard deviation."""

_BLOCK = 64
"""Rows that a scale is estimated from, at least: it is then within a tenth."""

_ROUNDS = 100
_SETTLED = 1e-3
"""Rounds end where right-hand sides move by no more than this part of the scale: far below any standard error."""


def pseudo_values(
    solve: Callable[[Array], Array], rhs: Array, is_used: npt.NDArray[np.bool_], length: int, count: int
) -> Array:
    """Return right-hand sides whose least squares are those of Huber's loss, with their standard errors.

    Residuals are clipped at the limit and put in place of themselves until nothing changes (Huber's modified residuals). In the end they
    are divided by the part of them that is not clipped, which gives least squares of these values the errors that hold for Huber's loss.

    Parameters
    ----------
    solve : callable
        Returns what the windows around every row predict of right-hand sides.
    rhs : ndarray, shape (n, q)
    is_used : ndarray of bool, shape (n,)
        Rows that count.
    length : int
        Rows in a window.
    count : int
        Regressors.
    """
    clipped, left, limits = rhs, np.zeros_like(rhs), np.zeros_like(rhs)
    for _ in range(_ROUNDS):
        left = rhs - solve(clipped)
        limits = LIMIT * _scales(left, is_used, length)
        there = np.isfinite(left) & np.isfinite(limits)
        with np.errstate(invalid="ignore"):  # right-hand sides that are infinite stay as they are
            moved = np.where(there, rhs - left + np.clip(left, -limits, limits), rhs)
            change = np.abs(moved - clipped)[there & is_used[:, None]]
        allowed = (_SETTLED * limits / LIMIT)[there & is_used[:, None]]
        clipped = moved
        if (change <= allowed).all():
            break
    inside = _window_means((np.abs(left) <= limits) | ~np.isfinite(left), is_used, length)
    # With p regressors in windows of n rows (Huber 1981, equation 6.7 of chapter 7).
    factor = (1 + count / length * (1 - inside) / inside) / inside
    there = np.isfinite(left) & np.isfinite(limits)
    return np.where(there, rhs - left + factor * np.clip(left, -limits, limits), rhs)


def _scales(left: Array, is_used: npt.NDArray[np.bool_], length: int) -> Array:
    """Return the standard deviation of normal residuals, from medians of blocks as long as windows, interpolated to every row."""
    rows = left.shape[0]
    edges = np.linspace(0, rows, max(1, rows // max(length, _BLOCK)) + 1).astype(int)
    centres, places = (edges[:-1] + edges[1:] - 1) / 2, np.arange(rows)
    found = np.full(left.shape, np.nan)
    for column in range(left.shape[1]):
        medians = np.full(centres.size, np.nan)
        for block, (first, end) in enumerate(pairwise(edges)):
            residuals = left[first:end, column][is_used[first:end]]
            residuals = residuals[np.isfinite(residuals)]
            if residuals.size:
                medians[block] = np.median(np.abs(residuals)) / _MEDIAN
        there = np.isfinite(medians)
        if there.any():
            found[:, column] = np.interp(places, centres[there], medians[there])
    return found


def _window_means(values: npt.NDArray[np.bool_], is_used: npt.NDArray[np.bool_], length: int) -> Array:
    """Return in which part of the rows that count, in the window around every row, something is true; one where there are none."""
    rows = np.arange(values.shape[0])
    first, end = np.maximum(rows - length // 2, 0), np.minimum(rows - length // 2 + length, rows.size)

    def sums(each: npt.NDArray[np.bool_]) -> Array:
        before = np.concatenate([np.zeros((1, each.shape[1])), np.cumsum(each, axis=0)])
        return np.asarray(before[end] - before[first])

    counted = sums(is_used[:, None])
    means = sums(values & is_used[:, None]) / np.maximum(counted, 1)
    return np.where(means > 0, means, 1.0)
