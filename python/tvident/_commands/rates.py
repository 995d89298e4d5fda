"""Whether the sample rate that was given is the one that a file shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from tvident import recordings
from tvident._files import other_rate, printable
from tvident._units import ROTARY, factor_to


def say_other_rate(
    channels: recordings.Channels, options: Mapping[str, Any], samples: tuple[int, ...], file: str | None
) -> None:
    """Warn where times beside so many samples show another rate than the one that was given, which is used."""
    try:
        rate = _given(options)
    except ValueError:
        return
    beside = {name: values for name, values in channels.items() if values.shape == samples}
    place = "standard input" if file in {None, "-"} else printable(file)
    words = None if rate is None else other_rate(beside, rate, place, "--time {}")
    if words is not None:
        click.echo(f"Warning: {words}", err=True)


def _given(options: Mapping[str, Any]) -> float | None:
    """Return the rate that was given, in whichever way."""
    rate, delta = options.get("sample_rate"), options.get("delta")
    if delta is not None and delta > 0:
        rate = 1 / (delta * factor_to(ROTARY, "time", options.get("time_unit"), name="the time"))
    return rate if rate is not None and rate > 0 else None
