"""The paper's identification in the strong form: equations (2)-(4), (8), (9) one after another, window by window."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from reference.local_polynomials import fit_window
from reference.regression import Solution, solve, window_rows

Array = npt.NDArray[np.float64]


def derivatives(angle: Array, half: int, delta: float, orders: npt.NDArray[np.uint8]) -> Array:
    """Give angle, velocity and acceleration at the centre of every full window, with the orders given; NaN elsewhere."""
    found = np.full((3, angle.size), np.nan)
    for i in range(half, angle.size - half):
        window = fit_window(angle[i - half : i + half + 1], delta, 15, 2)
        found[:, i] = window.derivatives[:, orders[i], half]
    return found


def scaled(A: Array) -> Array:
    """Give every column the same norm."""
    return np.asarray(A / np.maximum(np.linalg.norm(A, axis=0), np.finfo(np.float64).tiny))


def windowed(A: Array, torque: Array, equations: int) -> list[Solution | None]:
    """Solve (3), (4) around every sample, from the rows that exist.

    There is nothing where they are fewer than half of a window, or do not determine the unknowns.
    """
    usable = np.asarray(np.isfinite(A).all(axis=1))
    solutions: list[Solution | None] = []
    for i in range(torque.size):
        rows = window_rows(i, equations, torque.size)
        kept = usable[rows]
        too_few = 2 * kept.sum() < equations or kept.sum() <= A.shape[1]
        if too_few or np.linalg.matrix_rank(scaled(A[rows][kept])) < A.shape[1]:
            solutions.append(None)
        else:
            solutions.append(solve(A[rows][kept], torque[rows][kept]))
    return solutions
