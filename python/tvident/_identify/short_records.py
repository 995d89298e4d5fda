"""Records of a list that are too short to be identified: they cost no other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tvident._equation import COEFFICIENTS
from tvident._results import Identification, of_short

_OF_LENGTH = ("a record must hold at least", "the length of the record", "must not be empty")
"""In words, what says that a record is too short."""

_TOO_SHORT = 2
"""Samples of which nothing is known, whatever is said of them."""

CHANNELS = ("angle", "velocity", "acceleration", "torque", "instrument")
"""Arguments that are missing where a record is too short."""

OF_SAMPLES = ("mask", "weights", "t")
"""Others that have a value for every sample."""


def without_numbers(
    single: Callable[..., Identification], calls: Sequence[Mapping[str, Any]], place: int, error: ValueError
) -> Identification | None:
    """Return a result without numbers for a record that is shorter than others and too short; None where something else is wrong.

    Parameters
    ----------
    single : callable
        Identifies one record.
    calls : sequence of mapping
        Of all records; the longest is long enough, or its error is everybody's.
    place : int
        Which record.
    error : ValueError
        What was said of it.
    """
    sizes = [_samples(call) for call in calls]
    longest, size = calls[int(np.argmax(sizes))], sizes[place]
    is_short = size <= _TOO_SHORT or any(words in str(error) for words in _OF_LENGTH)
    if size >= max(sizes) or not is_short or not _are_of_one_length(calls[place], size):
        return None
    missing = {name: _missing(longest[name]) for name in CHANNELS}
    others = {name: longest[name] for name in OF_SAMPLES}
    known = {name: longest[name] for name in COEFFICIENTS if np.ndim(longest[name]) > 0}
    found = single(**{**calls[place], **missing, **others, **known, "progress": None})
    count = len(range(0, size, int(calls[place]["step"])))
    times = _times(calls[place]["t"])
    time = found.time[:count] if times is None else times[:: int(calls[place]["step"])]
    return of_short(found, np.asarray(time, dtype=np.float64), str(error))


def _missing(channel: Any) -> Any:
    """Return a channel of the same length in which everything is missing; None where there is none."""
    return None if channel is None else np.full(np.shape(channel), np.nan)


def _samples(call: Mapping[str, Any]) -> int:
    """Return how many samples of the motion a record has."""
    return next(int(np.size(call[name])) for name in CHANNELS if call[name] is not None)


def _are_of_one_length(call: Mapping[str, Any], size: int) -> bool:
    """Return whether channels and times of a record are as long as each other, or of clocks of their own."""
    if any(isinstance(call[name], tuple) for name in ("sample_rate", "delta", "t")):
        return True
    times = call["t"]
    given = [call[name] for name in CHANNELS] + [times if np.ndim(times) else None]
    return all(one is None or int(np.size(one)) == size for one in given)


def _times(given: Any) -> Any:
    """Return the times of the motion where they are numbers; None where there are none."""
    own = given[0] if isinstance(given, tuple) else given
    if own is None or np.asarray(own).dtype.kind not in "fiu":
        return None
    return np.ravel(np.asarray(own, dtype=np.float64))
