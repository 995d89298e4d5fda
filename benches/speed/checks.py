"""Both sides of a row must have computed the same thing before their times are compared.

What nobody else computes is compared with the slow reference that the tests use, in some windows.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import tvident
from reference.local_polynomials import fit_window
from reference.regression import solve, window_rows

Array = npt.NDArray[np.float64]

_SCALE = 1e-9
"""What the library promises of derivatives, as a fraction of their scale."""
_TIE = 1e-6
"""Scores closer than this may fall either way."""
_PARAMETERS = 1e-8
"""What the library promises of parameters, times the squared condition number."""
_PLACES = 7
"""Windows that are looked at."""


class DifferentError(Exception):
    """The two sides of a row did not compute the same thing."""


def same(what: str, ours: Array, theirs: Array, tolerance: float) -> None:
    """Compare two results; the tolerance is a fraction of their scale."""
    scale = float(np.max(np.abs(theirs)))
    distance = float(np.max(np.abs(ours - theirs)))
    if not distance <= tolerance * scale:
        raise DifferentError(f"{what} differ by {distance:.3g} of {scale:.3g}; at most {tolerance:g} of it is allowed")


def local_polynomials(y: Array, window_length: int, fit: tvident.LocalPolynomialFit) -> None:
    """Compare chosen orders and derivatives with the reference in some windows along the record."""
    half = window_length // 2
    scale = np.nanmax(np.abs(fit.derivatives), axis=-1)
    for centre in np.linspace(half, y.size - 1 - half, _PLACES).astype(int):
        window = fit_window(y[centre - half : centre + half + 1], 1.0, 15, 2)
        scores, order = window.scores(), int(fit.order[centre])
        if not scores[order] - scores.min() < _TIE:
            raise DifferentError(f"sample {centre} chose order {order}; the best of {scores} is {scores.argmin()}")
        error = np.abs(fit.derivatives[:, centre] - window.derivatives[:, order, half])
        if not (error <= _SCALE * scale).all():
            raise DifferentError(f"derivatives at sample {centre} are wrong by {error} of {scale}")


def identification(angle: Array, torque: Array, result: Any, window_length: int, rate: float) -> None:
    """Compare parameters with the reference in some windows: derivatives, equations and least squares in NumPy."""
    half, equations = window_length // 2, int(result.settings["regression_window"])
    margin = half + equations
    for i in np.linspace(margin, angle.size - 1 - margin, _PLACES).astype(int):
        rows = window_rows(int(i), equations, angle.size)
        regressors = np.empty((equations, 3))
        for row, centre in enumerate(range(rows.start, rows.stop)):
            window = fit_window(angle[centre - half : centre + half + 1], 1 / rate, 15, 2)
            scores, order = window.scores(), int(result.order[centre])
            if not scores[order] - scores.min() < _TIE:
                raise DifferentError(f"sample {centre} chose order {order}; the best of {scores} is {scores.argmin()}")
            regressors[row] = window.derivatives[::-1, order, half]
        expected = solve(regressors, torque[rows])
        found = np.array([result.inertia[i], result.damping[i], result.stiffness[i]])
        allowed = _PARAMETERS * expected.condition**2 * np.max(np.abs(expected.params))
        if not (np.abs(found - expected.params) <= allowed).all():
            raise DifferentError(f"parameters at sample {i} are {found}; the reference has {expected.params}")
