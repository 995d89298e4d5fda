"""Constants of many pieces, put together: their mean, whether pieces agree, and what windows beside them say with the mean.

Pieces that share constants c and nothing else are least squares whose sums of squares add up. So the constants of all are the mean of those
of the pieces, each weighted by the inverse of its variance. A windowed K is linear in the constants that it is estimated with. With `S` the
covariance of the constants `b` of its piece and `g` that of K and them, it is `K + gᵀ S⁻¹ (c - b)` where c is known; its variance is
less by `gᵀ S⁻¹ g`, and more by what is not known of c.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core

Numbers = npt.NDArray[np.float64]

Note = Mapping[str, Any]
"""What a piece says of constants, as JSON has it: values, errors, covariances, and of how many samples."""

_FEWEST = 0.5
"""Degrees of freedom of pieces that can disagree: two that hardly overlap have nearly one."""


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


@dataclass(frozen=True)
class Sums:
    r"""What pieces so far say of one constant, in numbers that do not grow.

    Piece ``k`` counts ``f`` times as much as the latest one, and its value has the error ``e``.

    Parameters
    ----------
    value : float
        The mean of all, each with the weight ``f / e²``.
    weight, squared : float
        Sums of ``f / e²`` and of ``f² / e²``.
    pieces, squared_pieces : float
        Sums of ``f`` and of ``f²``.
    scatter : float
        The sum of ``f (x - mean)² / e²``.
    """

    value: float = math.nan
    weight: float = 0.0
    squared: float = 0.0
    pieces: float = 0.0
    squared_pieces: float = 0.0
    scatter: float = 0.0

    def older(self, part: float) -> Sums:
        """Return the same where all so far counts only a part of what it did."""
        return Sums(
            self.value,
            self.weight * part,
            self.squared * part**2,
            self.pieces * part,
            self.squared_pieces * part**2,
            self.scatter * part,
        )

    def and_one(self, value: float, error: float) -> Sums:
        """Return the same with one more piece; what is not finite says nothing."""
        if not (math.isfinite(value) and 0 < error < math.inf):
            return self
        weight = 1 / error**2
        total = self.weight + weight
        mean = value if self.weight == 0 else self.value + (value - self.value) * weight / total
        # Welford's way: nothing large is subtracted from anything large.
        away = 0.0 if self.weight == 0 else (value - self.value) * (value - mean)
        return Sums(
            mean,
            total,
            self.squared + weight,
            self.pieces + 1,
            self.squared_pieces + 1,
            self.scatter + weight * away,
        )

    def mean(self, counted: float = 1.0) -> Mean:
        """Return what pieces say together.

        Parameters
        ----------
        counted : float
            How often a sample counts, where pieces overlap.
        """
        if self.weight == 0:
            return Mean(math.nan, math.nan, agree=True, spread=1.0)
        # What the scatter is on average where pieces differ by chance: their mean takes a part of it.
        expected = self.pieces - counted * self.squared / self.weight
        freedom = self.pieces * expected / (self.squared_pieces * counted)
        is_told = freedom >= _FEWEST
        agree = not is_told or self.scatter * freedom / expected <= _quantile(freedom)
        spread = math.sqrt(self.scatter / expected) if is_told else 1.0
        # What pieces scatter by beyond their errors is an error too.
        error = math.sqrt(counted * self.squared) / self.weight * max(1.0, spread)
        return Mean(self.value, error, agree=agree, spread=spread)


def _quantile(freedom: float) -> float:
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
        with np.errstate(all="ignore"):  # where a piece knows nothing
            slopes = self.inverse @ shared
            variance = error**2 - (slopes * shared).sum(axis=0)
            # Rounding may leave less than nothing of a variance that is all of the constants.
            variance = np.maximum(variance, 0.0) + (slopes * (self.covariance @ slopes)).sum(axis=0)
            return value + self.shift @ slopes, np.sqrt(variance)


def moved(note: Note, means: Mapping[str, Mean]) -> tuple[list[str], Moved] | None:
    """Return how a piece's numbers change, by its note: the constants that all pieces share, and the change; None where none does."""
    shared = [
        name
        for name in note["covariance_of"]
        if means[name].agree and math.isfinite(means[name].value) and math.isfinite(note["constants"][name][0])
    ]
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


NOTHING_SAID = Sums().mean()
"""Where no piece says anything."""


@dataclass
class Gathered:
    """What pieces so far say of all constants.

    Parameters
    ----------
    sums : dict of str to Sums
    counted, samples : float
        Samples that pieces were identified with, and those that are their own: neighbours count in several pieces.
    """

    sums: dict[str, Sums] = field(default_factory=dict)
    counted: float = 0.0
    samples: float = 0.0

    def add(self, note: Note, part: float = 1.0) -> None:
        """Take one more piece, by its note; those before count a part of what they did."""
        self.sums = {name: one.older(part) for name, one in self.sums.items()}
        for name, pair in note["constants"].items():
            self.sums[name] = self.sums.get(name, Sums()).and_one(*pair)
        self.counted = self.counted * part + note["counted"]
        self.samples = self.samples * part + note["samples"]

    def means(self) -> dict[str, Mean]:
        """Return what all pieces say of each constant."""
        return {name: one.mean(self.counted / max(self.samples, 1)) for name, one in self.sums.items()}


def means_of(notes: Sequence[Note]) -> dict[str, Mean]:
    """Return what all pieces say of their constants, by their notes."""
    gathered = Gathered()
    for note in notes:
        gathered.add(note)
    return gathered.means()
