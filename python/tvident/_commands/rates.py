"""Whether the sample rate that was given is the one that a file shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click
import numpy as np

from tvident import recordings
from tvident._files import FileRecording, printable, time_channels
from tvident._units import ROTARY, factor_to, named_unit

_NOTABLE = 1e-3
"""Of the rate: inertia goes with its square."""

_ROUGHLY = 0.1
"""Part of a step by which the usual one and the mean may differ, where times are not uniform."""

_OF_UNITS = (1e3, 1e6, 1e9, 60.0, 3600.0, 86400.0)
"""By which times without a unit differ from seconds: milliseconds to days."""


def say_other_rate(
    channels: recordings.Channels, options: Mapping[str, Any], samples: tuple[int, ...], file: str | None
) -> None:
    """Warn where times beside so many samples show another rate than the one that was given, which is used."""
    beside = {name: values for name, values in channels.items() if values.shape == samples}
    try:
        rate = _given(options)
        if rate is None:
            return
        recording = FileRecording(beside)
        shown, notable = _shown(recording)
    except ValueError:
        return
    if shown is None:
        return
    by = max(shown / rate, rate / shown)
    has_unit = any(recording.units.get(named_unit(name)[0]) for name in time_channels(beside))
    if by < 1 + notable or (not has_unit and any(abs(by / one - 1) < notable for one in _OF_UNITS)):
        return
    name = (time_channels(beside) or ["the channel of times"])[0]
    roughly = f"{shown:.7g} Hz" if notable == _NOTABLE else f"about {float(f'{shown:.3g}'):.7g} Hz"
    place = "standard input" if file in {None, "-"} else printable(file)
    click.echo(
        f"Warning: {printable(name)} of {place} shows {roughly}, not {rate:.7g}, which is used: velocities go with the rate, inertia "
        f"with the square of its inverse; give --time {printable(name)} instead, if it is right",
        err=True,
    )


def _given(options: Mapping[str, Any]) -> float | None:
    """Return the rate that was given, in whichever way."""
    rate, delta = options.get("sample_rate"), options.get("delta")
    if delta is not None and delta > 0:
        rate = 1 / (delta * factor_to(ROTARY, "time", options.get("time_unit"), name="the time"))
    return rate if rate is not None and rate > 0 else None


def _shown(recording: FileRecording) -> tuple[float | None, float]:
    """Return the rate that times show, None where they do not, and which part of it is notable."""
    times = recording.time
    if times is None:
        return None, _NOTABLE
    try:
        return recording.sample_rate, _NOTABLE
    except ValueError:
        steps = np.diff(times)
    usual, mean = float(np.median(steps)), float(np.mean(steps))
    # Where stamps are alike, or much is missing, they differ.
    is_known = usual > 0 and abs(mean / usual - 1) < _ROUGHLY
    return (1 / mean if is_known else None), 2 * _ROUGHLY
