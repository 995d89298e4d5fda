"""Which channel of a recording holds its times, and which may."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._units import ROTARY, Channel, UnitError, is_convertible, named_unit, times_in_seconds, unit_said

_NUMBERED = re.compile(r"[\s_.]*\d+$")
"""What tells clocks of one name apart, as time_2 and t1."""

_ALIKE = 0.01
"""Of a step: clocks of groups that were sampled together differ by rounding."""

_OF_UNITS = (1e3, 1e6, 1e9, 60.0, 3600.0, 86400.0)
"""By which times without a unit differ from seconds: milliseconds to days."""


def may_be_of_other_unit(by: float, notable: float) -> bool:
    """Return whether rates that differ by a factor may do so since times without a unit are in ms or minutes, say."""
    return any(abs(max(by, 1 / by) / one - 1) < notable for one in _OF_UNITS)


def time_channels(names: Iterable[str]) -> list[str]:
    """Return the names, without units and groups, of channels that are called as times are."""
    bare = (named_unit(name)[0].rpartition(".")[2] for name in names)
    return [name for name in bare if arguments.is_called_time(name)]


def increases(values: npt.NDArray[Any]) -> bool:
    """Return whether a channel increases all the time, as another clock does, which tells nothing of this one."""
    samples = np.asarray(values)
    return bool((samples[1:] > samples[:-1]).all())


def increasing_times(channels: Mapping[str, npt.NDArray[Any]]) -> list[str]:
    """Return the names of channels in a unit of time that increase from sample to sample, whatever they are called."""
    found = []
    for name, values in channels.items():
        is_duration = is_convertible(ROTARY, "time", named_unit(name)[1] or unit_said(values))
        if is_duration and values.ndim == 1 and values.size > 1 and increases(values):
            found.append(name)
    return found


def clock_among(channels: Mapping[str, npt.NDArray[Any]]) -> str | None:
    """Return the name of the channel of times; None where there is none, or several that differ."""
    long = {
        name: Channel(values, _unit(name, values))
        for name, values in channels.items()
        if values.ndim == 1 and values.size > 1
    }
    bare = {name: named_unit(name)[0] for name in long}
    found = [name for name, values in long.items() if arguments.is_time(bare[name], values.unit)]
    # Structures and groups put their names before those of their channels.
    grouped = [name for name, values in long.items() if arguments.is_time(bare[name].rpartition(".")[2], values.unit)]
    # A clock that is called more closely, as that of the system, may have begun long before; of two such none comes first.
    found.sort(key=lambda name: (arguments.is_of_one_clock(bare[name]), len(bare[name])))
    is_closer = bool(found) and arguments.is_of_one_clock(bare[found[0]])
    alike = [name for name in found if is_closer or _NUMBERED.sub("", bare[name]) == _NUMBERED.sub("", bare[found[0]])]
    called = alike or (grouped if len(grouped) == 1 else increasing_times(long))
    # Groups that were sampled together have one clock.
    called = called[:1] if all(_is_one_clock(long[called[0]], long[name]) for name in called[1:]) else called
    return called[0] if len(called) == 1 else None


def _unit(name: str, values: npt.NDArray[Any]) -> str:
    return named_unit(name)[1] or str(getattr(values, "unit", ""))


def _is_one_clock(one: Channel, other: Channel) -> bool:
    """Return whether two channels of times show the same, or differ by less than a hundredth of a step, as rounding makes them."""
    if one.shape != other.shape:
        return False
    if np.array_equal(one, other):
        return True
    try:
        first, second = (np.asarray(times_in_seconds(clock), np.float64) for clock in (one, other))
    except UnitError:
        return False
    step = float(np.median(np.abs(np.diff(first))))
    return bool(np.max(np.abs(first - second)) < _ALIKE * step)


def check_no_counts(first: float, step: float, unit_said: str, cure: str = "give t= and time_unit='{}'") -> None:
    """Refuse times so large that they count smaller parts of seconds since 1970, as clocks of computers do, or steps so small as of days.

    The other cure than another name may hold the unit.
    """
    counted = arguments.counted_since_1970(first)
    if counted is not None:
        unit, words = counted
        raise ValueError(
            f"the first, {words}; call the channel 'time [{unit}]', or {cure.format(unit)}, if it counts such since 1970"
        )
    if 0 < step <= arguments.TOO_SHORT and unit_said:
        raise ValueError(
            f"one sample in {step:.4g} s would be {1 / step:.4g} Hz; check whether the channel is in {unit_said}, and call it by its unit"
        )
    if not unit_said and arguments.may_be_days(step):
        raise ValueError(
            f"one sample in {step:.4g} s would be {1 / step:.4g} Hz; call the channel 'time [days]', or {cure.format('days')}, if "
            "it counts days, as datenum of MATLAB and spreadsheets do"
        )
