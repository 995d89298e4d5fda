"""Asks whether numbers far from all others mark missing values, where they stand for so long, or so often, that nothing leaves them out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvident._arguments import CLOSE_TO_MARK, marks_in
from tvident._results import MARKED

_TURNS, _PART = 4, 0.1
"""Times that a torque stands at a number above zero, and the part of all samples, from which on a drive is turned on and off."""

_NO_TORQUE = 1e10
"""No drive has so much torque, in any unit."""

_MOMENT, _SELDOM = 50, 0.02
"""Samples, and the part of all: what stands for less, and is not more often, is a reading that failed, which is seen and left out."""


@dataclass(frozen=True)
class Numbers:
    """Numbers of a call, and what they were before they were converted.

    Parameters
    ----------
    name : str
        What questions call them.
    values : ndarray, shape (..., n)
        In units of results.
    factor : float
        By which they were multiplied.
    turn : float
        Within which, in units of results, an angle that wraps stands anywhere; 0 for what does not wrap.
    is_measured : bool
        Whether single readings that failed are left out.
    """

    name: str
    values: npt.NDArray[np.number]
    factor: float = 1.0
    turn: float = 0.0
    is_measured: bool = True


def marks_that_stay(numbers: Iterable[Numbers], period: float) -> list[tuple[int, str]]:
    """Return records and questions about what may mark missing values in them; a period is seconds from one sample to the next."""
    asked = []
    for one in numbers:
        for record, values in enumerate(one.values.reshape(-1, one.values.shape[-1])):
            asked += [(record, words) for words in _questions(one, values, period)]
    return asked


def without_masked_marks(one: Numbers, mask: npt.NDArray[np.bool_] | None) -> tuple[npt.NDArray[np.number], list[str]]:
    """Return a channel without marks that a mask leaves out, every one of them, and what was done in words: the mask says what they are."""
    if mask is None:
        return one.values, []
    samples = one.values.shape[-1]
    recorded, masks = one.values.reshape(-1, samples), np.broadcast_to(mask, one.values.shape).reshape(-1, samples)
    several, words = one.values.ndim > 1, []
    values = recorded
    for record, (own, kept) in enumerate(zip(recorded, masks, strict=True)):
        for mark, places in _found(one, own):
            if kept[places].any():
                continue
            values = recorded.astype(np.float64) if values is recorded else values
            values[record, places] = np.nan
            words.append(
                f"{f'record {record}: ' if several else ''}the {one.name} is {mark:.7g} at {places.size} samples, which mask= leaves out: "
                "they are taken as missing"
            )
    return one.values if values is recorded else values.reshape(one.values.shape), words


def _found(one: Numbers, recorded: npt.NDArray[np.number]) -> list[tuple[float, npt.NDArray[np.intp]]]:
    """Return numbers that may be marks, as they were before they were converted, and the samples at which they stand."""
    return [
        (mark, np.flatnonzero(np.isclose(recorded, mark * one.factor, rtol=CLOSE_TO_MARK, atol=0)))
        for mark, _ in marks_in(recorded if one.factor == 1 else recorded / one.factor)
        if abs(mark * one.factor) > one.turn
    ]


def _questions(one: Numbers, recorded: npt.NDArray[np.number], period: float) -> list[str]:
    found = [
        (mark, places)
        for mark, places in _found(one, recorded)
        if not (one.is_measured and _is_seen(places, recorded.size))
    ]
    is_driven = any(0 < mark < _NO_TORQUE for mark, _ in found)
    is_driven = is_driven and all(_is_turned_on(places, recorded.size) for _, places in found)
    if one.name.startswith(("torque", "instrument")) and is_driven:
        return []
    return [_question(one.name, mark, places, period) for mark, places in found]


def _runs(places: npt.NDArray[np.intp]) -> list[npt.NDArray[np.intp]]:
    return np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)


def _is_seen(places: npt.NDArray[np.intp], samples: int) -> bool:
    """Return whether readings are so few and so short that they are left out as those that failed."""
    is_short = max(map(len, _runs(places))) <= _MOMENT and places.size <= _SELDOM * samples
    return is_short and places[0] > 0 and places[-1] < samples - 1


def _is_turned_on(places: npt.NDArray[np.intp], samples: int) -> bool:
    runs = _runs(places)
    return len(runs) >= _TURNS and places.size >= _PART * samples and min(map(len, runs)) > 1


def _question(name: str, mark: float, places: Sequence[int] | npt.NDArray[np.intp], period: float) -> str:
    count = f"{len(places)} sample{'s' if len(places) > 1 else ''}"
    where = f"the {name} is {mark:.7g} at {count}, first at {places[0] * period:.4g} s, far from all its other values"
    return f"{where}: {MARKED} It counts as measured; give numpy.nan in its place, or read the file with missing={mark:.7g}"
