"""Other sizes that explain a record nearly as well: their mean, and by how much a curve depends on which was taken."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import Basis

if TYPE_CHECKING:
    from tvident._expansion.fit import ScoredSize

Array: TypeAlias = npt.NDArray[np.float64]

Key = TypeVar("Key", bound=Hashable)

_TEMPER, _LESS_LIKELY = 0.25, 0.25
"""Weights are exp(-AICc / 4), of which Leung and Barron (2006) prove that the mean is nearly as good as the best of its curves, times
exp(-1/4) for each further function: prior odds, by which few functions that explain a record equally well count more."""


def weights_of(scores: Mapping[Key, ScoredSize]) -> dict[Key, float]:
    """Return how much each of some sizes counts in the mean of their curves; of sum one, or nothing where none explains the record."""
    exponents = {key: _TEMPER * one.criterion + _LESS_LIKELY * one.size for key, one in scores.items()}
    least = min(exponents.values(), default=math.inf)
    if not math.isfinite(least):
        return {}
    found = {key: math.exp(least - one) for key, one in exponents.items()}
    whole = sum(found.values())
    return {key: one / whole for key, one in found.items()}


@dataclass(frozen=True)
class Rival:
    """A curve by functions of some size.

    Parameters
    ----------
    weight : float
        Its part of the mean over sizes.
    basis : Basis
    factors : ndarray, shape (size,)
    root : ndarray, shape (size, k)
        A root of their covariance.
    """

    weight: float
    basis: Basis
    factors: Array
    root: Array

    def curve(self, functions: Array) -> tuple[Array, Array]:
        """Return the curve and its variance where functions have these values, shape (places, size)."""
        return functions @ self.factors, ((functions @ self.root) ** 2).sum(axis=1)


@dataclass(frozen=True)
class Rivals:
    """Curves of all sizes that count, of the same parameter.

    Parameters
    ----------
    curves : sequence of Rival
        The size that was taken first.
    is_averaged : bool
        Whether the parameter is their mean, not the curve of the size that was taken.
    """

    curves: Sequence[Rival] = ()
    is_averaged: bool = False

    def beside(self, functions: Callable[[Basis], Array]) -> tuple[Array | float, Array | float]:
        """Return what the mean adds to the curve that was taken, and what the choice of a size adds to its variance.

        The variance is that of a weighted mean over sizes (Buckland, Burnham, Augustin 1997), around the curve that is given. Functions of
        a basis are those at the places that are asked for.
        """
        if len(self.curves) <= 1:
            return 0.0, 0.0
        found = [one.curve(functions(one.basis)) for one in self.curves]
        taken, variance = found[0]
        weights = [one.weight for one in self.curves]
        moved = np.zeros(taken.size)
        if self.is_averaged:
            moved += sum(weight * (values - taken) for weight, (values, _) in zip(weights, found, strict=True))
        added = np.zeros(taken.size)
        for weight, (values, other) in zip(weights, found, strict=True):
            added += weight * ((values - taken - moved) ** 2 + np.maximum(other - variance, 0))
        return moved, added
