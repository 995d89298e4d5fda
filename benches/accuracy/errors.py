"""Errors of what was identified, in %."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

import tvident

Array = npt.NDArray[np.float64]

PARAMETERS = ("stiffness", "inertia", "damping")
"""In the order in which the tables give them."""

_NORMAL_95 = 1.959964
"""Half-width of the nominal 95 % interval in standard errors."""

_MARGIN = 0.075
"""Share of the record at either end that is no part of its interior: 3 s of 40 s."""


def interior(samples: int) -> slice:
    """Return the samples whose errors count: all but 7.5 % at either end."""
    margin = round(_MARGIN * samples)
    return slice(margin, samples - margin)


def nrmse(found: Array, truth: Array) -> float:
    """Return the root mean square error over the mean of the true magnitude, in %, where something was found."""
    finite = np.isfinite(found)
    if not finite.any():
        return float("nan")
    return 100 * float(np.sqrt(np.mean((found[finite] - truth[finite]) ** 2)) / np.mean(np.abs(truth[finite])))


def of_parameters(found: Mapping[str, Array], recording: tvident.Recording) -> dict[str, float]:
    """Return the error of every parameter over the record's interior, and the share of samples where nothing was found."""
    inside = interior(recording.time.size)
    errors = {name: nrmse(found[name][inside], getattr(recording, name)[inside]) for name in PARAMETERS}
    missing = float(np.mean(~np.isfinite(found["stiffness"][inside])))
    return errors | {"missing": missing}


def of_acceleration(found: Array, recording: tvident.Recording) -> float:
    """Return the root mean square error of the second derivative over its standard deviation, in %."""
    inside = interior(recording.time.size)
    truth = recording.true_acceleration[inside]
    return 100 * float(np.sqrt(np.mean((found[inside] - truth) ** 2)) / truth.std())


def coverage(error: Array, deviation: Array) -> float:
    """Return the share of samples where the nominal 95 % interval holds the truth, of those where something was found."""
    known = np.isfinite(error) & np.isfinite(deviation)
    return float(np.mean(np.abs(error[known]) <= _NORMAL_95 * deviation[known])) if known.any() else float("nan")
