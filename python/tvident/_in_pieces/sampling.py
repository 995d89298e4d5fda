"""When the samples of a long recording were taken: at a rate that is given, or as its file says, or at its times."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import FileWarning, check_no_counts, clock_among, full_name, listed, other_rate, said_otherwise
from tvident._in_pieces.recorded import uniform
from tvident._in_pieces.sources import Source
from tvident._units import ROTARY, Channel, is_convertible, named_unit, times_in_seconds

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
    times, (delta, rate) = _times(source, samples), rates
    if delta is not None or rate is not None:
        if t is not None:
            raise TypeError("give only one of delta, sample_rate and t; got t too; drop all but one")
        period = arguments.sample_period(samples, delta=delta, sample_rate=rate)
        _say_other_rate(source, times, 1 / period)
        return 0.0, period
    if t is not None:
        return _at_times(source, t, samples)
    said, clock = source.said, clock_among(times)
    for remark in said.remarks:
        warnings.warn(f"{source.place}: {remark}", FileWarning, stacklevel=4)
    if clock is not None and (said.rate is None or said.text is not None):
        if said.text is not None and (words := said_otherwise(said.text, times)):
            warnings.warn(f"{source.place}: {words}", FileWarning, stacklevel=4)
        return _at_times(source, clock, samples)
    if said.rate is not None:
        _say_other_rate(source, times, said.rate)
        return _first_time(source, clock, samples, said.rate), 1 / said.rate
    several = f"several channels of times ({listed(times)})" if len(times) > 1 else "no channel of times"
    wrong = said.wrong and f"; {said.wrong}"
    raise TypeError(
        f"an identification needs the sample period; {source.place} has {several}{wrong}; give sample_rate=, delta= or t="
    )


def _times(source: Source, samples: int) -> dict[str, npt.NDArray[Any]]:
    """Return the first samples of channels that may be times, by their names with units."""
    found = {}
    for name, (channel, count) in source.channels.items():
        bare, unit = named_unit(name)
        if count == samples and (
            arguments.is_called_time(bare.rpartition(".")[2]) or is_convertible(ROTARY, "time", unit)
        ):
            found[name] = channel.read(0, min(samples, _TIMES))
    return found


def _at_times(source: Source, name: str, samples: int) -> tuple[float, float]:
    channel, unit = source.of_length("times", name, samples)
    factor = float(times_in_seconds(Channel(np.ones(1), unit))[0])
    called = full_name(source.channels, name, source.place)
    begin, period = uniform(channel, samples, factor, called)
    try:
        check_no_counts(begin, period, unit, "give sample_rate=")
    except ValueError as error:
        raise ValueError(f"times must tell the sample period; channel {called!r} does not: {error}") from None
    return begin, period


def _first_time(source: Source, clock: str | None, samples: int, rate: float) -> float:
    """Return the first of the times beside a rate that the file says, where they are uniform and show that rate; 0 elsewhere."""
    try:
        begin, period = (0.0, 1 / rate) if clock is None else _at_times(source, clock, samples)
    except ValueError:
        return 0.0
    return begin if abs(period * rate - 1) < _ALIKE else 0.0


def _say_other_rate(source: Source, times: dict[str, npt.NDArray[Any]], rate: float) -> None:
    """Warn where the first times of a recording show another rate than the one that is used."""
    words = other_rate(times, rate, source.place, "that channel as times") if times else None
    if words is not None:
        warnings.warn(words, FileWarning, stacklevel=5)
