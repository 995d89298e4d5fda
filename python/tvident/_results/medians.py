"""How well the median of a windowed parameter is known: better than any of its samples, but for what all of them have in common."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._results.verdict import unflagged

Array = npt.NDArray[np.float64]

_LOOKED_AT = 1 << 12
"""Samples that are looked at."""

_NOWHERE = 1e-3
"""Samples by density times error around a median, below which the parameter jumps over it and its place is not known."""


def median_of(result: Any, name: str) -> tuple[float, float]:
    """Return one number for an unknown coefficient, and the error of that number.

    ``result.value(name)`` has the same number beside the median of the errors of the samples: how well the parameter is known at one of
    them. Medians are compared by the error of a median.

    Parameters
    ----------
    result : Identification
        Of one record.
    name : str

    Returns
    -------
    value, stderr : float
    """
    one = result.value(name)
    in_common = float(np.asarray(result._found.in_common.get(name, 1.0)))  # noqa: SLF001 - of this room
    length = result.settings["regression_window"]
    # A record that determines nothing has no windows.
    if one.kind != "windowed" or isinstance(length, str):
        return one.value, one.stderr
    values, errors = getattr(result, name), result.stderr[name]
    there = np.isfinite(values) & (errors > 0) & np.isfinite(errors)
    good = there & unflagged(result)
    some = good if good.any() else there
    window = length / result.settings["step"]
    return one.value, error_of_median(values, np.where(some, errors, np.nan), in_common, window)


def error_of_median(values: Array, errors: Array, in_common: float, window: float) -> float:
    r"""Return the standard error of the median of values whose errors are one within each window, and independent between windows.

    The median :math:`m` is where half of the samples lie below. How many do is uncertain by their errors, and moves it by as much over the
    density of the samples there:

    .. math:: s^2 = \sum_w \operatorname{var}\Big(\sum_{j \in w} [x_j < m]\Big) \Big/ \Big(\sum_j \varphi(z_j) / \sigma_j\Big)^2,
              \qquad z_j = (m - x_j) / \sigma_j

    Within a window the covariance of two samples is :math:`\Phi(\min(z_i, z_j)) - \Phi(z_i)\,\Phi(z_j)`. So N windows of one value tell
    :math:`s = \sigma \sqrt{\pi / 2 N}`, and of a ramp only those that pass the median.

    Parameters
    ----------
    values, errors : ndarray, shape (n,)
        At the samples, with their standard errors; NaN at those that do not count.
    in_common : float
        The part of the errors' squares that all samples have in common. It moves the median as it moves them.
    window : float
        Samples of a window.
    """
    there = np.flatnonzero(np.isfinite(values) & np.isfinite(errors))
    there = there[:: max(1, math.ceil(there.size / _LOOKED_AT))]
    if not there.size:
        return np.nan
    value, error = values[there], errors[there]
    shared = math.sqrt(in_common) * float(np.median(error))
    if not in_common < 1:
        return shared
    own = error * math.sqrt(1 - in_common)
    away = (np.median(value) - value) / own
    below = 0.5 + 0.5 * np.array([math.erf(one / math.sqrt(2)) for one in away.tolist()])
    windows = np.split(below, np.flatnonzero(np.diff(there // window)) + 1)
    # In order each is the smaller one of its pairs with all that follow.
    variance = sum(float(np.sort(one) @ np.arange(2 * one.size - 1, 0, -2)) - float(one.sum()) ** 2 for one in windows)
    with np.errstate(all="ignore"):  # so far away that nothing is left
        nearby = np.exp(-0.5 * away**2) / math.sqrt(2 * math.pi)
    if nearby.sum() < _NOWHERE:
        return np.inf
    return math.hypot(math.sqrt(max(variance, 0.0)) / float(np.sum(nearby / own)), shared)
