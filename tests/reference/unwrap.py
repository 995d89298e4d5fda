"""Unwrapping sample by sample."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def unwrapped_slowly(angle: npt.NDArray[np.float64], period: float) -> npt.NDArray[np.float64]:
    """Add the whole periods that make every step from the last sample that is there the shortest."""
    found, last = angle.copy(), None
    for place, value in enumerate(angle):
        if not np.isfinite(value):
            continue
        if last is not None:
            turns = [round((last - value) / period) + more for more in (-1, 0, 1)]
            found[place] = min((value + period * turn for turn in turns), key=lambda one: abs(one - last))
        last = found[place]
    return found
