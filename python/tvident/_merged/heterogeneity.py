"""Whether trials differ by more than their errors explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tvident import _core

_NO_CHANCE = 3.3
"""Standard deviations: once in 2000 records, as in the test of constancy."""


def excess(differences: npt.NDArray[np.float64], errors: npt.NDArray[np.float64]) -> float:
    """Return how much more trials scatter than their errors explain, as a factor of the variance; one where it may be chance.

    The sum of squares over variances follows χ² with one degree of freedom less than there are trials; its cube root is nearly normal
    (Wilson and Hilferty 1931).
    """
    known = np.isfinite(differences) & (errors > 0)
    freedom = int(known.sum()) - 1
    if freedom < 1:
        return 1.0
    weights = 1 / errors[known] ** 2
    mean = float(np.sum(weights * differences[known]) / np.sum(weights))
    ratio = float(np.sum(weights * (differences[known] - mean) ** 2)) / freedom
    spread = 2 / (9 * freedom)
    normal = (ratio ** (1 / 3) - (1 - spread)) / spread**0.5
    return max(ratio, 1.0) if normal > _NO_CHANCE else 1.0


def differences_of(spread: Sequence[_core.Estimate]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return by how much each trial differs, and the standard errors."""
    return np.array([one.value for one in spread]), np.array([one.stderr for one in spread])
