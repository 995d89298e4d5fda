"""How many equations gaps take, and whether it is worth to bridge them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from tvident._clocks.grid import Numbers

USUAL = 2
"""Samples in a row that are missing where some are lost, at most; longer gaps are bridged only where they take many equations."""

LONGEST = 32
"""Samples of a usual test function: a gap that is not bridged takes as many equations. Longer ones are not bridged."""

FEW, _MANY = 0.1, 0.25
"""Parts of the equations, as more of those that are left: if gaps take less than the first, they are left out as they are, and long gaps
as long as they take less than the second."""

_MOST_SAVED = 500.0
"""Logarithm of more equations than any record has."""

_SEEN, _FOLLOWED = 1e-3, 0.1
"""Parts of a channel's root mean square: what splines may miss whatever its noise is, and the most over long gaps, however few
equations are left."""


def gaps_of(row: Numbers, fewest: int, most: int) -> float:
    """Return how many gaps of so many samples there are for each sample; NaN is missing."""
    steps = np.diff(np.flatnonzero(np.isfinite(row)))
    return int(np.count_nonzero((steps > fewest) & (steps <= most + 1))) / max(row.size, 1)


def taken(gaps: float) -> float:
    """Return how many equations so many gaps for each sample take, for each that they leave."""
    return math.expm1(min(LONGEST * gaps, _MOST_SAVED))


def take_many(gaps: float) -> bool:
    """Tell whether so many gaps for each sample take many equations, so that long ones are bridged, too."""
    return taken(gaps) >= _MANY


def is_worth(lost: int, gaps: Numbers, bias: Numbers, variance: Numbers, squares: Numbers) -> npt.NDArray[np.bool_]:
    """Return in which channels gaps are worth being bridged: what splines add to the variance of equations is less than these lose.

    Parameters
    ----------
    lost : int
        Samples that lie in each, at most.
    gaps : ndarray
        How many there are for each sample of a channel.
    bias, variance, squares : ndarray
        Mean squares of what splines miss beyond noise, of this, and of the channel.
    """
    saved = variance * np.expm1(np.minimum(LONGEST * gaps, _MOST_SAVED))
    return np.asarray((bias <= _SEEN**2 * squares) | (lost * gaps * bias <= saved))


def are_followed(bias: Numbers, squares: Numbers) -> npt.NDArray[np.bool_]:
    """Return which channels splines follow at all over long gaps: what they miss beyond noise is little of the channel's mean square."""
    return np.asarray(bias <= _FOLLOWED**2 * squares)


def beyond(wrong: Numbers, of_noise: Numbers | float, variance: Numbers) -> Numbers:
    """Return by how much mean squares are larger than noise makes them."""
    return np.maximum(wrong - variance * of_noise, 0.0)


def mean_of(values: Numbers) -> float:
    """Return the mean of what is known; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else math.nan
