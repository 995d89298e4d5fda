"""The paper's identification in the strong form: equations (2)-(4), (8), (9) one after another, window by window."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from reference.local_polynomials import fit_windows
from reference.regression import Solutions, solve_windows, window_rows

Array = npt.NDArray[np.float64]


def derivatives(angle: Array, half: int, delta: float, orders: npt.NDArray[np.uint8]) -> Array:
    """Give angle, velocity and acceleration at the centre of every full window, with the orders given; NaN elsewhere."""
    found = np.full((3, angle.size), np.nan)
    full = slice(half, angle.size - half)
    windows = fit_windows(angle, half, delta, 15, 2).derivatives
    found[:, full] = windows[np.arange(len(windows)), :, orders[full]].T
    return found


def windowed(A: Array, torque: Array, equations: int) -> Solutions:
    """Solve (3), (4) around every sample, from the rows that exist.

    There is nothing where they are fewer than half of a window, or do not determine the unknowns.
    """
    usable = np.asarray(np.isfinite(A).all(axis=1))
    windows = []
    for i in range(torque.size):
        rows = window_rows(i, equations, torque.size)
        kept = rows.start + np.flatnonzero(usable[rows])
        windows.append(kept if 2 * kept.size >= equations else kept[:0])
    return solve_windows(A, torque, windows)
