"""What trials or masses were identified from, as far as reports and simulations need it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._equation import Term
from tvident._results import mark_of

Numbers = npt.NDArray[np.number]


@dataclass(frozen=True)
class MergedRecorded:
    """Channels of every trial, by reference: they are not copied.

    Parameters
    ----------
    angles : sequence of sequence of ndarray, shape (n,)
        By trial, then by mass.
    torques : sequence of sequence of (ndarray or None)
        None for a force that was not measured.
    bases : sequence of (ndarray or None)
        By trial.
    positions : sequence of ndarray, optional
        The sample of the result that every sample belongs to, by trial.
    structure : Chain or Mechanism, optional
    own : mapping of str to Term
        Terms of the user's own.
    """

    angles: Sequence[Sequence[Numbers]]
    torques: Sequence[Sequence[Numbers | None]]
    bases: Sequence[Numbers | None]
    positions: Sequence[npt.NDArray[np.float64]] | None = None
    structure: Any = None
    own: Mapping[str, Term] = field(default_factory=dict)
    _marks: tuple[npt.NDArray[np.uint64], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_marks", self._found_marks())

    @property
    def is_unchanged(self) -> bool:
        """Whether nobody has written another record into the arrays meanwhile."""
        return all(map(np.array_equal, self._marks, self._found_marks()))

    def on_result(self, trial: int, values: npt.NDArray[Any], samples: int) -> npt.NDArray[np.float64]:
        """Return a channel of a trial at the samples of the result: as it is, or along the phase."""
        if self.positions is None:
            return np.asarray(values, np.float64)
        return np.asarray(np.interp(np.arange(samples), self.positions[trial], values, left=np.nan, right=np.nan))

    def _found_marks(self) -> tuple[npt.NDArray[np.uint64], ...]:
        each = [one for of in (*self.angles, *self.torques, self.bases) for one in of if one is not None]
        return tuple(map(mark_of, each))
