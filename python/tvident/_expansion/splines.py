"""B-splines on evenly spaced knots, by the recurrence of Cox and de Boor."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


def spline_values(degree: int, places: Array, size: int, derivative: int) -> Array:
    """Return B-splines of a degree on the interval from 0 to 1, or their derivatives, shape (places, size).

    Knots are even, and as many at both ends as make the first and the last function one there. Fewer functions than the degree needs are
    those of a lower degree: one is constant, two are a line.
    """
    degree = min(degree, size - 1)
    if derivative > degree:
        return np.zeros((places.size, size))
    cells = size - degree
    knots = np.concatenate([np.zeros(degree), np.linspace(0, 1, cells + 1), np.ones(degree)])
    cell = np.clip((places * cells).astype(np.int64), 0, cells - 1) + degree
    local = _not_zero(knots, cell, places, degree - derivative)
    rows = np.arange(places.size)[:, np.newaxis]
    lower = np.zeros((places.size, size - derivative))
    lower[rows, cell[:, np.newaxis] - degree + np.arange(degree - derivative + 1)] = local
    return lower @ _slopes(knots, degree, size, derivative) if derivative else lower


def _not_zero(knots: Array, cell: npt.NDArray[np.int64], places: Array, degree: int) -> Array:
    """Return the functions of a degree that are not zero in every place's cell, shape (places, degree + 1)."""
    found = np.ones((places.size, 1))
    for order in range(1, degree + 1):
        higher = np.zeros((places.size, order + 1))
        for function in range(order):
            left = knots[cell + function + 1 - order]
            right = knots[cell + function + 1]
            share = found[:, function] / (right - left)
            higher[:, function] += (right - places) * share
            higher[:, function + 1] += (places - left) * share
        found = higher
    return found


def _slopes(knots: Array, degree: int, size: int, derivative: int) -> Array:
    """Return by which factors functions of a lower degree make the derivatives of those of a higher one."""
    found = np.eye(size)
    for order in range(derivative):
        left = degree - order
        now = knots[order : len(knots) - order]
        count = size - order
        # Between the functions i - 1 and i lies the lower one i, of the same knots without the outermost.
        width = now[1 + left : count + left] - now[1:count]
        found = left * np.diff(found, axis=0) / width[:, np.newaxis]
    return found
