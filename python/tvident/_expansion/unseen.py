"""Where no equation sees a curve of time: near the ends of a record and in its gaps it bends as it does elsewhere.

Test functions vanish at both of their ends, so the first and the last half-width of a record say next to nothing. Many functions have room
to swing there: 60 Chebyshev polynomials over 20 s change within some ms of an end. So the second difference of the curve there is taken to
be zero with the standard deviation that it has where equations see the curve: a prior distribution whose width the record tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import AT_A_TIME, Basis
from tvident._expansion.rows import ExpandedRecord, curve_length

Array: TypeAlias = npt.NDArray[np.float64]

_SEEN = 0.5
"""An equation sees what is at most so many half-widths of its test function from its centre."""

_NEAR = 8.0
"""Half-widths from what is not seen to where equations on both sides say what a curve is."""

_WIDER = 1.4
"""The standard deviation is taken for so many times that of elsewhere, twice its variance: a curve need not bend alike everywhere."""


@dataclass(frozen=True)
class Bend:
    """How a curve bends where it is seen.

    Parameters
    ----------
    deviation : float
        Root mean square of its second difference.
    steps : float
        After how many steps of the differences it bends anew: the root mean square of first differences over that of second ones.
    """

    deviation: float
    steps: float


@dataclass(frozen=True)
class Unseen:
    """The samples of some records that no equation of any of them sees.

    Parameters
    ----------
    records : sequence of ExpandedRecord
        With the same test function; their samples are those of the curves.
    """

    records: Sequence[ExpandedRecord]

    @property
    def _half(self) -> int:
        return self.records[0].half

    @cached_property
    def _samples(self) -> int:
        return curve_length(self.records)

    @property
    def step(self) -> int:
        """Samples between the values of a difference."""
        return self.records[0].stride

    @cached_property
    def is_seen(self) -> npt.NDArray[np.bool_]:
        """Whether an equation sees a sample, shape (n,)."""
        reach = int(_SEEN * self._half)
        change = np.zeros(self._samples + 1, np.int64)
        for record in self.records:
            centres = np.flatnonzero(record.usable_rows().any(axis=1)) * record.stride + record.half
            if record.alignment is not None:
                centres = record.alignment.nearest[centres]
            np.add.at(change, np.maximum(centres - reach, 0), 1)
            np.add.at(change, np.minimum(centres + reach + 1, self._samples), -1)
        return np.cumsum(change[:-1]) > 0

    @cached_property
    def _is_near(self) -> npt.NDArray[np.bool_]:
        """Whether a sample is near one that is not seen: equations on one side of it alone say little."""
        reach = int(_NEAR * self._half)
        unseen = np.concatenate([[1], ~self.is_seen, [1]])
        count = np.concatenate([[0], np.cumsum(unseen)])
        place = np.arange(1, unseen.size - 1)
        return np.asarray(count[np.minimum(place + reach + 1, unseen.size)] > count[np.maximum(place - reach, 0)])

    @cached_property
    def places(self) -> npt.NDArray[np.intp]:
        """Samples around which differences are taken to be small."""
        around = np.arange(self.step, self._samples - self.step, self.step)
        return around[self._is_near[around]]

    def bend(self, curve: Array) -> Bend | None:
        """Return how a curve bends where it is seen; None where it is straight, or nowhere seen.

        Parameters
        ----------
        curve : ndarray, shape (n,)
        """
        along, seen = curve[:: self.step], ~self._is_near[:: self.step]
        second, first = np.diff(along, 2), np.diff(along)
        bends, changes = second[seen[:-2] & seen[1:-1] & seen[2:]], first[seen[:-1] & seen[1:]]
        if not bends.size:
            return None
        deviation = float(np.sqrt(np.mean(bends**2)))
        if not deviation > 0:
            return None
        return Bend(deviation, max(1.0, float(np.sqrt(np.mean(changes**2))) / deviation))

    def rows(self, basis: Basis, bend: Bend) -> Array:
        """Return equations of variance 1 that say how far a curve bends where it is not seen, shape (rows, size).

        Neighbouring differences are nearly the same: so many as are between two bends count as one.
        """
        found = np.empty((self.places.size, basis.size))
        for first in range(0, self.places.size, AT_A_TIME):
            some = slice(first, first + AT_A_TIME)
            around = self.places[some]
            before, at, behind = (_functions(basis, around + k) for k in (-self.step, 0, self.step))
            found[some] = before - 2 * at + behind
        return np.asarray(found / (_WIDER * bend.deviation * np.sqrt(bend.steps)))


def _functions(basis: Basis, samples: npt.NDArray[np.intp]) -> Array:
    """Return the functions at some samples."""
    return np.asarray(basis.at([one.places[samples] for one in basis.coordinates]))
