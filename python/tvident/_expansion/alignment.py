"""Records whose samples lie elsewhere along curves that they share: cycles of one motion that are aligned on a phase."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import Basis, Coordinate

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AlignedSamples:
    """Where the samples of a record lie along shared curves.

    Parameters
    ----------
    positions : ndarray, shape (n,)
        The sample of the curves that every sample belongs to, in samples.
    length : int
        Samples of the curves.
    is_periodic : bool
        Whether curves go on beyond their ends as they begin.
    """

    positions: Array
    length: int
    is_periodic: bool = False
    _known: dict[int, tuple[Coordinate, Coordinate]] = field(default_factory=dict, repr=False)

    @property
    def is_inside(self) -> npt.NDArray[np.bool_]:
        """Whether a sample lies along the curves, shape (n,)."""
        if self.is_periodic:
            return np.ones(self.positions.size, np.bool_)
        return np.asarray((self.positions >= 0) & (self.positions <= self.length - 1))

    @property
    def is_centre(self) -> npt.NDArray[np.bool_]:
        """Whether a row may have its centre at a sample: beyond the ends of a cycle the next one has it."""
        return np.asarray((self.positions >= 0) & (self.positions < self.length))

    @cached_property
    def nearest(self) -> npt.NDArray[np.intp]:
        """The sample of the curves that is nearest to every sample, shape (n,)."""
        place = np.rint(self.positions).astype(np.intp)
        return np.asarray(place % self.length if self.is_periodic else np.clip(place, 0, self.length - 1))

    @cached_property
    def _rates(self) -> tuple[Array, Array]:
        """How fast positions grow, and how fast that changes, in samples a sample."""
        rate = np.gradient(self.positions)
        return rate, np.gradient(rate)

    def values(self, along: Array) -> Array:
        """Return a curve at the samples of the record."""
        period = self.length if self.is_periodic else None
        return np.interp(self.positions, np.arange(along.size), along, period=period)

    def curve(self, values: Sequence[Array], period: float) -> list[Array]:
        """Return a curve and its derivatives by time at the samples of the record, which are so many seconds apart."""
        found = [self.values(one) for one in values]
        rate, change = self._rates
        if len(found) > 2:  # noqa: PLR2004 - the second derivative
            found[2] = found[2] * rate**2 + found[1] * change / period
        if len(found) > 1:
            found[1] = found[1] * rate
        return found

    def basis(self, basis: Basis, period: float) -> Basis:
        """Return functions of the same coordinates at the samples of the record."""
        return Basis([self._own(one, period) for one in basis.coordinates], basis.families, basis.sizes)

    def _own(self, one: Coordinate, period: float) -> Coordinate:
        key = id(one)
        if key not in self._known:
            # Places of time go on beyond the ends.
            evenly = one.places[0] + self.positions * (one.places[1] - one.places[0])
            places = evenly if one.is_of_time else self.values(one.places)
            _, *rates = self.curve([one.places, *one.rates], period)
            # The coordinate that was asked for is kept too, so that its identity is its own.
            self._known[key] = one, Coordinate(places, np.stack(rates), one.limits, one.is_of_time)
        return self._known[key][1]
