"""Whether the sample rate that was given is the one that a file shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from tvident import recordings
from tvident._files import FileRecording, printable, time_channels

_NOTABLE = 1e-3
"""Of the rate: inertia goes with its square."""

_OF_UNITS = (1e3, 1e6, 1e9, 60.0, 3600.0)
"""By which times without a unit differ from seconds."""


def say_other_rate(
    channels: recordings.Channels, options: Mapping[str, Any], samples: tuple[int, ...], file: str | None
) -> None:
    """Warn where times beside so many samples show another rate than the one that was given, which is used."""
    rate, delta = options.get("sample_rate"), options.get("delta")
    if delta is not None and options.get("time_unit") is None:
        rate = 1 / delta if delta > 0 else None
    if rate is None or not rate > 0:
        return
    beside = {name: values for name, values in channels.items() if values.shape == samples}
    try:
        recording = FileRecording(beside)
        times, shown = recording.time, recording.sample_rate
    except ValueError:
        return
    # Times say their unit, or are taken for seconds.
    by = max(shown / rate, rate / shown)
    if times is None or by < 1 + _NOTABLE or any(abs(by / one - 1) < _NOTABLE for one in _OF_UNITS):
        return
    name = (time_channels(beside) or ["the channel of times"])[0]
    place = "standard input" if file in {None, "-"} else printable(file)
    click.echo(
        f"Warning: {printable(name)} of {place} shows {shown:.7g} Hz, not {rate:.7g}, which is used: velocities go with the rate, inertia "
        f"with the square of its inverse; give --time {printable(name)} instead, if it is right",
        err=True,
    )
