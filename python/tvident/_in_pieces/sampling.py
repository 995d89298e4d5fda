"""When the samples of a long recording were taken: at a rate that is given, or as its file says, or at its times."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import FileWarning, full_name, other_rate, said_otherwise
from tvident._in_pieces.recorded import uniform
from tvident._in_pieces.sources import Source
from tvident._units import Channel, named_unit, times_in_seconds

_TIMES = 4096
"""Samples whose times are held against the rate that is used."""

_ALIKE = 1e-6
"""Of a period: a million samples on, times differ by one of them."""


def begin_and_period(
    source: Source, samples: int, rates: tuple[float | None, float | None], t: str | None
) -> tuple[float, float]:
    """Return when the first sample was taken, and the sample period, in seconds.

    Raises
    ------
    TypeError
        If nothing tells them, or several arguments do.
    ValueError
        If times are not uniform.
    """
    times, (delta, rate) = _times(source), rates
    if delta is not None or rate is not None:
        if t is not None:
            raise TypeError("give only one of delta, sample_rate and t; got t too; drop all but one")
        period = arguments.sample_period(samples, delta=delta, sample_rate=rate)
        _say_other_rate(source, times, samples, 1 / period)
        return 0.0, period
    if t is not None:
        return _at_times(source, t, samples)
    said = source.said
    for remark in said.remarks:
        warnings.warn(f"{source.place}: {remark}", FileWarning, stacklevel=4)
    if times and (said.rate is None or said.text is not None):
        if said.text is not None and (words := said_otherwise(said.text, _first(source, times, samples))):
            warnings.warn(f"{source.place}: {words}", FileWarning, stacklevel=4)
        return _at_times(source, times[0], samples)
    if said.rate is not None:
        _say_other_rate(source, times, samples, said.rate)
        return _first_time(source, times, samples, said.rate), 1 / said.rate
    raise TypeError(
        f"an identification needs the sample period; {source.place} has no channel of times; give sample_rate=, delta= or t="
    )


def _times(source: Source) -> list[str]:
    """Return the channels of times; those of groups where only one group has one."""
    named = {one: named_unit(one) for one in source.channels}
    times = [one for one, (name, unit) in named.items() if arguments.is_time(name, unit)]
    if times:
        return times
    # Groups put their names before those of their channels; the times of which group, only one of them says.
    grouped = [one for one, (name, unit) in named.items() if arguments.is_time(name.rpartition(".")[2], unit)]
    return grouped if len(grouped) == 1 else []


def _at_times(source: Source, name: str, samples: int) -> tuple[float, float]:
    channel, unit = source.of_length("times", name, samples)
    factor = float(times_in_seconds(Channel(np.ones(1), unit))[0])
    return uniform(channel, samples, factor, full_name(source.channels, name, source.place))


def _first_time(source: Source, times: Sequence[str], samples: int, rate: float) -> float:
    """Return the first of the times beside a rate that the file says, where they are uniform and show that rate; 0 elsewhere."""
    try:
        begin, period = _at_times(source, times[0], samples) if times else (0.0, 1 / rate)
    except ValueError:
        return 0.0
    return begin if abs(period * rate - 1) < _ALIKE else 0.0


def _first(source: Source, times: Sequence[str], samples: int) -> dict[str, npt.NDArray[Any]]:
    """Return the first samples of channels of times."""
    beside = {name: source.channels[name][0] for name in times if source.channels[name][1] == samples}
    return {name: channel.read(0, min(samples, _TIMES)) for name, channel in beside.items()}


def _say_other_rate(source: Source, times: Sequence[str], samples: int, rate: float) -> None:
    """Warn where the first times of a recording show another rate than the one that is used."""
    first = _first(source, times, samples)
    words = other_rate(first, rate, source.place, "that channel as times") if first else None
    if words is not None:
        warnings.warn(words, FileWarning, stacklevel=5)
