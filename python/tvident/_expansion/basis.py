"""The functions of an expansion along a record: values and rates at its samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.families import Family

Array: TypeAlias = npt.NDArray[np.float64]

AT_A_TIME = 1 << 14
"""Samples at which functions are in memory at a time."""


@dataclass(frozen=True)
class Coordinate:
    """What one factor of the functions depends on, scaled to the interval from 0 to 1.

    Parameters
    ----------
    places : ndarray, shape (n,)
    rates : ndarray, shape (2, n)
        Their first and second derivative by time.
    limits : (float, float)
        The range that was scaled, in the channel's unit.
    is_of_time : bool
        Whether places grow evenly along the record.
    """

    places: Array
    rates: Array
    limits: tuple[float, float]
    is_of_time: bool = False


@dataclass(frozen=True)
class Basis:
    """Functions of one or two coordinates along a record.

    Parameters
    ----------
    coordinates : sequence of Coordinate
    families : sequence of Family
    sizes : sequence of int
    """

    coordinates: Sequence[Coordinate]
    families: Sequence[Family]
    sizes: Sequence[int]

    @property
    def size(self) -> int:
        """How many functions there are."""
        return int(np.prod(self.sizes))

    def along(self, samples: slice, rate: int) -> Array:
        """Return the functions at some samples, or their first or second derivative by time, shape (samples, size)."""
        values, first, second = [], [], []
        for coordinate, family, size in zip(self.coordinates, self.families, self.sizes, strict=True):
            places = coordinate.places[samples]
            values.append(family.values(places, size, 0))
            if rate:
                speed = coordinate.rates[0, samples, np.newaxis]
                first.append(family.values(places, size, 1) * speed)
            if rate == 2:  # noqa: PLR2004 - the second derivative
                change = coordinate.rates[1, samples, np.newaxis]
                second.append(family.values(places, size, 2) * speed**2 + family.values(places, size, 1) * change)
        if len(values) == 1:
            return (values, first, second)[rate][0]
        if rate == 0:
            return _products(values[0], values[1])
        if rate == 1:
            return _products(first[0], values[1]) + _products(values[0], first[1])
        both = _products(second[0], values[1]) + _products(values[0], second[1])
        return np.asarray(both + 2 * _products(first[0], first[1]))

    def blocks(self, samples: slice) -> npt.NDArray[np.int64] | None:
        """Return which function is one at some samples, where functions are one at a time and zero otherwise; None for others."""
        if any(family.block is None for family in self.families):
            return None
        found = np.zeros(1, np.int64)
        for coordinate, family, size in zip(self.coordinates, self.families, self.sizes, strict=True):
            assert family.block is not None  # noqa: S101 - for mypy
            found = found * size + family.block(coordinate.places[samples], size)
        return found

    def at(self, places: Sequence[Array]) -> Array:
        """Return the functions at places from 0 to 1, shape (places, size)."""
        each = [
            family.values(place, size, 0) for place, family, size in zip(places, self.families, self.sizes, strict=True)
        ]
        return each[0] if len(each) == 1 else _products(each[0], each[1])


def _products(one: Array, other: Array) -> Array:
    """Return all products of two sets of functions, the second running faster."""
    return np.asarray((one[:, :, np.newaxis] * other[:, np.newaxis, :]).reshape(len(one), -1))
