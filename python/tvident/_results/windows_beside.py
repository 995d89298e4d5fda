"""Windows in the place of an expansion: whether they find what it finds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_JUMPS = 2.0
"""Standard errors that a jump of windows must be large for an expansion to have to follow it."""

_FOLLOWED = 0.5
"""Of a jump, by which an expansion must change within the test function to follow it."""

_OFF = 5.0
"""Standard errors of the difference from windows that an expansion may be off just before and just after a jump."""


@dataclass(frozen=True)
class WindowsBeside:
    """A parameter as windows found it.

    Parameters
    ----------
    values, errors : ndarray, shape (n,)
    trusted : ndarray of bool, shape (n,)
    samples : int
        That a window's rows touch.
    half : int
        Of the test function.
    jumps : sequence of int
        First samples after jumps.
    """

    values: Array
    errors: Array
    trusted: npt.NDArray[np.bool_]
    samples: int
    half: int
    jumps: Sequence[int]

    def differ(self, values: Array, errors: Array) -> tuple[float, int]:
        """Return the mean squared difference from windows over its variance, and at how many windows, which hardly share equations.

        Parameters
        ----------
        values, errors : ndarray, shape (n,)
            Of the expansion.
        """
        apart = slice(self.samples // 2, None, max(1, self.samples))
        there = self.trusted[apart] & np.isfinite(values[apart])
        if not there.any():
            return float("nan"), 0
        variance = self.errors[apart] ** 2 + errors[apart] ** 2
        squares = ((self.values[apart] - values[apart]) ** 2 / variance)[there]
        return float(np.mean(squares)), int(there.sum())

    def missed_jumps(self, values: Array, errors: Array) -> list[int]:
        """Return the jumps that the expansion does not follow within the test function that sees both sides.

        Parameters
        ----------
        values, errors : ndarray, shape (n,)
            Of the expansion.
        """
        missed = []
        for at in self.jumps:
            before, after = max(at - self.half, 0), min(at + self.half, self.values.size - 1)
            if not 0 < at < self.values.size:
                continue
            # Beside it few equations are left, since no test function may reach over it.
            size = self.values[after] - self.values[before]
            known = abs(size) > _JUMPS * np.hypot(self.errors[after], self.errors[before])
            beside = [before, after]
            differs = np.abs(values[beside] - self.values[beside]) > _OFF * np.hypot(
                errors[beside], self.errors[beside]
            )
            if known and (differs.any() or not (values[after] - values[before]) / size > _FOLLOWED):
                missed.append(at)
        return missed
