"""What models cost, and the weights that follow from their criteria."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._results import Identification

Array: TypeAlias = npt.NDArray[np.float64]


def effective_parameters(result: Identification, samples: int) -> float:
    """Return how many parameters were estimated: one for a constant; for a windowed one as many as windows have coefficients.

    Where no window was long enough for anything it is not known (NaN).
    """
    settings, count = result.settings, float("angle_zero" in result.constants)
    known = settings["known"]
    for name in ("inertia", "damping", "stiffness", *result.terms):
        if name in known:
            continue
        if name in result.constants:
            count += 1
        else:
            window = settings["regression_window"]
            windows = samples / window if isinstance(window, int) else math.nan
            count += windows * (2 if settings["variation"] == "linear" else 1)
    return count + len(settings["inner"])


def akaike_weights(scores: Array) -> Array:
    """Return the weight of each model; a model without a score has none."""
    if not np.isfinite(scores).any():
        return np.zeros(scores.size)
    with np.errstate(under="ignore"):  # where a caller had underflows raised
        relative = np.exp(-0.5 * (scores - scores.min()))
    return np.asarray(relative / relative.sum())


def averaged(values: Array, errors: Array, weights: Array) -> tuple[Array, Array]:
    """Return means over models, the first axis, and errors that know of the choice: Σ w √(error² + (value - mean)²).

    Where a model has no number the others count.
    """
    weights = weights.reshape(-1, *(1,) * (values.ndim - 1))
    there = np.isfinite(values) & np.isfinite(errors) & (weights > 0)
    share = np.where(there, weights, 0.0)
    with np.errstate(all="ignore"):
        share = share / share.sum(axis=0)
        values, errors = np.where(there, values, 0.0), np.where(there, errors, 0.0)
        mean = np.sum(share * values, axis=0)
        return np.asarray(mean), np.asarray(np.sum(share * np.hypot(errors, values - mean), axis=0))
