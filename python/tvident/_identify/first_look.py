"""A first look at what may be missing: what every term leaves of equations of given lengths, which costs next to nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from tvident._identify.tried_record import WORTH, Names

_MOST = 3
"""Terms that are sought together."""


class FirstLook:
    """What may be missing, by what it leaves of the same equations.

    Lengths that are chosen for each equation follow what is missing, and to choose them takes longest: those of a look are given,
    and longer than those at hand. So it tells what is worth identifying in full, and nothing else.

    Parameters
    ----------
    left : callable
        Takes names and returns the mean square of what equations with these terms leave; infinite where that is not known, or
        where one of them cannot be what it is called.
    worth : float
        The part of what is left before that is left at most of what is seen.
    """

    def __init__(self, left: Callable[[Names], float], worth: float = WORTH) -> None:
        self._left, self._worth = cache(left), worth

    @property
    def tells(self) -> bool:
        """Whether a look at the record was possible."""
        return 0 < self._left(()) < np.inf

    def seen(self, names: Sequence[str], beside: Names = ()) -> list[str]:
        """Return those that explain a part of what is left beside others, the most first."""
        before = self._left(beside)
        left = {one: self._left((*beside, one)) for one in names if one not in beside}
        return sorted((one for one in left if left[one] <= self._worth * before < np.inf), key=left.__getitem__)

    def together(self, names: Sequence[str]) -> Names:
        """Return those that explain a part each beside the others before them."""
        chosen: Names = ()
        while len(chosen) < _MOST and (seen := self.seen(names, chosen)):
            chosen = (*chosen, seen[0])
        return chosen
