"""Whether a sample rate that was given is the one that the times of a file show."""

from __future__ import annotations

import numpy as np

from tvident._files.channels import Channels
from tvident._files.names import printable
from tvident._files.recorded import FileRecording
from tvident._files.which_clock import may_be_of_other_unit, time_channels
from tvident._units import named_unit

_NOTABLE = 1e-3
"""Of the rate: inertia goes with its square."""

_ROUGHLY = 0.1
"""Part of a step by which the usual one and the mean may differ, where times are not uniform."""


def other_rate(channels: Channels, rate: float, place: str, option: str) -> str | None:
    """Return that the times among some channels show another rate than one in Hz, and how to give them; None where they show no other."""
    try:
        recording = FileRecording(channels)
        shown, notable = _shown(recording)
    except ValueError:
        return None
    if shown is None:
        return None
    by = max(shown / rate, rate / shown)
    times = time_channels(channels)
    has_unit = any(recording.units.get(named_unit(name)[0]) for name in times)
    if by < 1 + notable or (not has_unit and may_be_of_other_unit(by, notable)):
        return None
    name = printable((times or ["the channel of times"])[0])
    roughly = f"{shown:.7g} Hz" if notable == _NOTABLE else f"about {float(f'{shown:.3g}'):.7g} Hz"
    return (
        f"{name} of {place} shows {roughly}, not {rate:.7g}, which is used: velocities go with the rate, inertia with the "
        f"square of its inverse; give {option.format(name)} instead, if it is right"
    )


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
