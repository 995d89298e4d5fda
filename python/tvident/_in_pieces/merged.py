"""Constants of many pieces, put together: their mean, whether pieces agree, and what windows beside them say with the mean.

Pieces that share constants c and nothing else are least squares whose sums of squares add up. So the constants of all are the mean of those
of the pieces, each weighted by the inverse of its variance. A windowed K is linear in the constants that it is estimated with. With `S` the
covariance of the constants `b` of its piece and `g` that of K and them, it is `K + gᵀ S⁻¹ (c - b)` where c is known; its variance is
less by `gᵀ S⁻¹ g`, and more by what is not known of c.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core

Numbers = npt.NDArray[np.float64]

_FEWEST = 2
"""Pieces that can disagree."""


@dataclass(frozen=True)
class Mean:
    """What many pieces say of one constant.

    Parameters
    ----------
    value, error : float
        NaN where no piece says anything.
    agree : bool
        Whether pieces differ by no more than chance.
    spread : float
        The root of the mean squared difference of a piece from the mean, over its standard error.
    """

    value: float
    error: float
    agree: bool
    spread: float


def mean_of(values: Sequence[float], errors: Sequence[float], counted: float = 1.0) -> Mean:
    """Return what pieces say of a constant together.

    Parameters
    ----------
    values, errors : sequence of float
        One a piece; what is not finite says nothing.
    counted : float
        How often a sample counts, where pieces overlap.
    """
    known = [
        (one, error) for one, error in zip(values, errors, strict=True) if math.isfinite(one) and 0 < error < math.inf
    ]
    if not known:
        return Mean(math.nan, math.nan, agree=True, spread=1.0)
    value, error = np.array(known).T
    weight = 1 / np.square(error)
    mean = float(np.sum(weight * value) / weight.sum())
    freedom = len(known) - 1
    squares = float(np.sum(weight * np.square(value - mean)))
    agree = len(known) < _FEWEST or squares <= _quantile(freedom)
    spread = math.sqrt(squares / freedom) if freedom else 1.0
    # What pieces scatter by beyond their errors is an error too.
    return Mean(mean, math.sqrt(counted / float(weight.sum())) * max(1.0, spread), agree=agree, spread=spread)


def _quantile(freedom: int) -> float:
    """Return what a χ² variable exceeds by no chance (Wilson and Hilferty)."""
    normal = NormalDist().inv_cdf(1 - _core.NO_CHANCE)
    part = 2 / (9 * freedom)
    return freedom * (1 - part + normal * math.sqrt(part)) ** 3


@dataclass(frozen=True)
class Moved:
    """How the numbers of one piece change when its constants become those of all.

    Parameters
    ----------
    shift : ndarray, shape (constants,)
        The constants of all less those of the piece.
    slopes : ndarray, shape (constants, constants)
        The inverse of the covariance of the piece's constants.
    covariance : ndarray, shape (constants, constants)
        What is not known of the constants of all.
    """

    shift: Numbers
    inverse: Numbers
    covariance: Numbers

    def of(self, value: Numbers, error: Numbers, shared: Numbers) -> tuple[Numbers, Numbers]:
        """Return a windowed parameter and its error, where `shared` are its covariances with the constants, shape (constants, n)."""
        slopes = self.inverse @ shared
        variance = error**2 - np.einsum("cn,cn->n", slopes, shared)
        # Rounding may leave less than nothing of a variance that is all of the constants.
        variance = np.maximum(variance, 0.0) + np.einsum("cn,cd,dn->n", slopes, self.covariance, slopes)
        return value + self.shift @ slopes, np.sqrt(variance)


def moved(note: Mapping[str, Any], means: Mapping[str, Mean]) -> tuple[list[str], Moved] | None:
    """Return how a piece's numbers change, by its note: the constants that all pieces share, and the change; None where none does."""
    shared = [name for name in note["covariance_of"] if means[name].agree and math.isfinite(note["constants"][name][0])]
    if not shared:
        return None
    places = [note["covariance_of"].index(name) for name in shared]
    covariance = np.array(note["covariance"])[np.ix_(places, places)]
    shift = np.array([means[name].value - note["constants"][name][0] for name in shared])
    errors = np.sqrt(covariance.diagonal())
    # The constants of all are correlated as those of a piece are.
    all_errors = np.array([means[name].error for name in shared])
    correlation = covariance / np.outer(errors, errors)
    return shared, Moved(shift, np.linalg.inv(covariance), correlation * np.outer(all_errors, all_errors))


def means_of(notes: Sequence[Mapping[str, Any]]) -> dict[str, Mean]:
    """Return what all pieces say of their constants, by their notes."""
    names = dict.fromkeys(name for note in notes for name in note["constants"])
    counted = sum(note["counted"] for note in notes) / max(sum(note["samples"] for note in notes), 1)
    pairs = {name: [note["constants"][name] for note in notes if name in note["constants"]] for name in names}
    return {
        name: mean_of([value for value, _ in each], [error for _, error in each], counted)
        for name, each in pairs.items()
    }
