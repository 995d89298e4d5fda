"""Asks whether numbers far from all others mark missing values, where they stand for so long that nothing leaves them out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from tvident._arguments import CLOSE_TO_MARK, mark_in

MARKED = "does it mark values that are missing?"
"""What the questions have in common."""

_TURNS, _PART = 4, 0.1
"""Times that a torque stands at a number above zero, and the part of all samples, from which on a drive is turned on and off."""

_MOMENT = 50
"""Samples: what stands for less is a reading that failed, which is seen, left out and said."""


def marks_that_stay(
    channels: Mapping[str, npt.NDArray[np.number]], factors: Mapping[str, float], period: float
) -> list[tuple[int, str]]:
    """Return records and questions about what may mark missing values in them.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (..., n)
        Of a call, in units of results.
    factors : mapping of str to float
        By which they were multiplied.
    period : float
        Seconds from one sample to the next.
    """
    asked = []
    for name, values in channels.items():
        for record, one in enumerate(values.reshape(-1, values.shape[-1])):
            words = _words(name, one, factors[name], period)
            if words:
                asked.append((record, words))
    return asked


def _words(name: str, recorded: npt.NDArray[np.number], factor: float, period: float) -> str:
    found = mark_in(recorded if factor == 1 else recorded / factor)
    if found is None:
        return ""
    mark, count = found
    are_marks = np.isclose(recorded, mark * factor, rtol=CLOSE_TO_MARK, atol=0)
    places = np.flatnonzero(are_marks)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    if max(map(len, runs)) <= _MOMENT and not are_marks[0] and not are_marks[-1]:
        return ""
    is_often = len(runs) >= _TURNS and count >= _PART * recorded.size and min(map(len, runs)) > 1
    if name == "torque" and mark > 0 and is_often:
        return ""
    where = f"the {name} is {mark:.7g} at {count} samples, first at {places[0] * period:.4g} s, far from all its other values"
    cure = f"give numpy.nan in its place, or read the file with missing={mark:.7g}"
    return f"{where}: {MARKED} It counts as measured; {cure}"
