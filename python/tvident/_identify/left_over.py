"""What a model leaves unexplained of parts of a record that were held back from the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tvident._arguments import percent
from tvident._results import TRIED, Identification, predicted_ahead

AS_GOOD = 1.25
"""A simpler equation is advised where it leaves at most so many times what the other leaves."""


class Unexplained(NamedTuple):
    """Shares of the angle's variance that are not predicted of what is held back; infinite where that is not known.

    Parameters
    ----------
    share : float
        Of all parts.
    steady : float
        Without the parts that are predicted worst: where something changes suddenly nothing is foreseen, whatever the equation is.
    """

    share: float
    steady: float


@dataclass(frozen=True)
class Left:
    """What a model leaves unexplained of what is held back, and what the model at hand does, predicted equally far ahead."""

    least: Unexplained
    now: Unexplained

    @property
    def ratio(self) -> float:
        """The first over the second, or over all where the model at hand predicts nothing; infinite if it is the worse one of all parts."""
        if not 0 < self.now.steady < np.inf:
            return self.least.share
        return self.least.steady / self.now.steady if self.least.share <= self.now.share else np.inf

    @property
    def is_as_much(self) -> bool:
        """Whether both explain about as much."""
        pairs = ((self.least.share, self.now.share), (self.least.steady, self.now.steady))
        return all(least <= AS_GOOD * now for least, now in pairs)

    def __str__(self) -> str:
        before = f", not {percent(1 - self.now.share)}" if self.now.share < 1 else ""
        return f"then {percent(1 - self.least.share)} {TRIED}{before}"


def unexplained(result: Identification, ahead: int | None = None) -> Unexplained:
    """Return what is not predicted so many samples ahead, by default one test function ahead."""
    shares = [1 - predicted / 100 for predicted in predicted_ahead(result, ahead)]
    return Unexplained(*(share if np.isfinite(share) else np.inf for share in shares))
