"""Clocks in two columns: whole seconds, and beside them the milliseconds, microseconds or nanoseconds of each."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from tvident._arguments import is_called_time
from tvident._files.channels import Channels, Say
from tvident._files.names import printable
from tvident._files.second_words import PARTS, PER_SECOND, SECOND, without_clock
from tvident._units import named_unit, with_unit

_SINCE_1970 = re.compile(r"unix|epoch|unix[_ ]?time", re.IGNORECASE)
"""What whole seconds are called, too."""

_AS_LONG = 3.0
"""How much longer than all other steps those to a new second may be."""

_SINCE = 1e8
"""Seconds from which on a clock counts from long ago, and its first whole second is taken off: parts of a second need the digits."""

Numbers = npt.NDArray[np.float64]


def with_whole_clocks(channels: Channels, say: Say) -> Channels:
    """Return channels, of which a clock in two columns is one in their place, in seconds; which is said."""
    for name, per_second in _parts_of_seconds(channels):
        for other in channels:
            times = _together(channels, other, name, per_second)
            if times is None:
                continue
            bare = named_unit(other)[0]
            group, dot, last = bare.rpartition(".")
            called = with_unit(bare if is_called_time(last) else f"{group}{dot}time", "s")
            if called in channels.keys() - {other, name}:
                continue
            since = float(np.floor(times[0])) if times[0] >= _SINCE else 0.0
            from_when = f", from {since:.0f} on" if since else ""
            say(
                f"'{printable(other, 40)}' holds whole seconds and '{printable(name, 40)}' parts of them: read together as "
                f"'{printable(called, 40)}'{from_when}"
            )
            whole = np.asarray(channels[other], np.float64) - since
            one = whole + np.asarray(channels[name], np.float64) / per_second
            return {
                called if key == other else key: one if key == other else values
                for key, values in channels.items()
                if key != name
            }
    return channels


def _parts_of_seconds(channels: Channels) -> list[tuple[str, float]]:
    """Return channels that are called as parts of a second are, or in a unit of these, and how many are in one."""
    found = []
    for name in channels:
        bare, unit = named_unit(name)
        said = without_clock(unit or bare.rpartition(".")[2])
        found += [(name, PER_SECOND[part]) for part, pattern in PARTS.items() if pattern.fullmatch(said)]
    return found


def _together(channels: Channels, seconds: str, parts: str, per_second: float) -> Numbers | None:
    """Return the times that two channels say together; None where they are no clock in two parts.

    Whole seconds stay what they are for some samples, parts begin again with every second, and both together never go back.
    """
    bare, unit = named_unit(seconds)
    group, _, last = bare.rpartition(".")
    whole_name = without_clock(seconds.rpartition(".")[2])
    is_called = any(
        (is_called_time(last), SECOND.fullmatch(last), SECOND.fullmatch(whole_name), _SINCE_1970.fullmatch(last))
    )
    is_second = not unit or SECOND.fullmatch(unit) is not None
    if seconds == parts or not is_called or not is_second or group != named_unit(parts)[0].rpartition(".")[0]:
        return None
    whole, part = channels[seconds], channels[parts]
    if whole.ndim != 1 or whole.shape != part.shape or not {whole.dtype.kind, part.dtype.kind} <= set("iuf"):
        return None
    whole, part = whole.astype(np.float64), part.astype(np.float64)
    with np.errstate(invalid="ignore"):
        is_whole = bool((whole == np.floor(whole)).all() and (np.diff(whole) >= 0).all() and (part >= 0).all())
        goes_back = np.diff(part) < 0
        if not is_whole or not (part < per_second).all() or not goes_back.any():
            return None
    times = whole + part / per_second
    steps = np.diff(times)
    # A second ends where its parts are nearly used up: what repeats otherwise is no part of a clock.
    is_clock = (steps >= 0).all() and float(np.median(steps[goes_back])) <= _AS_LONG * float(steps.mean())
    return times if is_clock else None
