"""An angle that a recorder holds: it was read more slowly than its samples say, and splines go from reading to reading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import ordinal
from tvident._clocks.grid import Numbers
from tvident._clocks.passed import Passed

_ORDER = 5
"""Of the splines, as for channels on clocks of their own."""

_GAP = 1.5
"""Readings beyond which a step is a gap."""

_LOOKED_AT, _STILL = 1 << 12, 1 / 3
"""Samples at the beginning, of which at least this part repeats the one before where a channel is held."""

_LEAST, _MOST = 2, 50
"""Samples that hold a reading."""

_FEWEST, _OFTEN, _IN_BEAT = 50, 0.5, 0.99
"""Changes that tell a beat, the part of the readings that must change something, and the part of the changes that must come in the beat."""

_JITTER = 0.4
"""By which part of the usual step, or a sample, readings may come early or late."""

_OFF = 0.1
"""Samples by which readings may be seen elsewhere than those of an even clock are, which is known no better."""

_STEPS = 2.0
"""A channel that was rounded changes by one step at a time where it changes seldom; one that is held by at least so many, mostly."""

_SAME = 1e-6
"""Samples by which a reading may seem to come after the sample that shows it, by rounding."""


@dataclass(frozen=True)
class Unheld:
    """Channels with what was held between readings replaced.

    Parameters
    ----------
    channels : mapping of str to ndarray
    passed : mapping of str to Passed
        What white noise of the readings became, of the channels that were held.
    words, doubt : str
        What was done, and what to do.
    """

    channels: Mapping[str, npt.NDArray[np.number]]
    passed: Mapping[str, Passed]
    words: str
    doubt: str

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep: nothing, for every record shows how it was read."""
        return {}


def unheld(channels: Mapping[str, npt.NDArray[np.number]], period: float, workers: int | None) -> Unheld | None:
    """Return channels without the steps of an angle that holds its readings; None where it does not.

    A machine moves between two readings, so what an angle holds there is its recorder's. A torque that is held may be what acts, as that of
    a digital controller, and stays as it is, unless both channels were read at once.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (*, n)
        The angle and the torque among them.
    period : float
        Seconds from one sample to the next.
    workers : int, optional
    """
    found = _readings(channels["angle"])
    if found is None:
        return None
    samples, places = found
    of_torque = _readings(channels["torque"])
    names = ["angle", *(["torque"] if of_torque is not None and np.array_equal(of_torque[0], samples) else [])]
    between = np.diff(places)
    hold = float(between.mean())
    resampling = _core.Resampling(places, channels["angle"].shape[-1], order=_ORDER, bridged=_GAP * math.ceil(hold))
    even = {name: _between(resampling, np.asarray(channels[name])[..., samples], workers) for name in names}
    whose = "both channels hold every value" if len(names) > 1 else "the angle holds every value"
    whose = f"{whose} for {hold:.3g} samples"
    words = (
        f"{whose}, as where it was read at {1 / (period * hold):.4g} Hz: the first of them is the reading, and splines of order {_ORDER} "
        "go from reading to reading"
    )
    own = (
        f"keep every {ordinal(hold)} sample of both channels"
        if hold == round(hold) and float(np.ptp(between)) == 0
        else "give it times of its own, t=(…, …)"
    )
    doubt = f"{whose}: splines between its readings were taken instead; better record it as it is read, or {own}"
    return Unheld({**channels, **even}, dict.fromkeys(names, Passed(resampling, workers)), words, doubt)


def holds_that_stay(angles: npt.NDArray[np.number]) -> list[tuple[int, str]]:
    """Return what to do about angles that hold their readings, by record, where nothing replaced what they hold."""
    found = ((record, readings_of(row)) for record, row in enumerate(angles.reshape(-1, angles.shape[-1])))
    holds = {record: float(np.diff(one[1]).mean()) for record, one in found if one is not None}
    what = "which makes it late by half of that, and its steps are no motion"
    cure = "use method='auto', which takes its readings and splines between them, or give it times of its own, t=(…, …)"
    return [
        (record, f"the angle holds every value for {hold:.3g} samples, {what}: {cure}")
        for record, hold in holds.items()
    ]


def _between(resampling: _core.Resampling, readings: npt.NDArray[np.number], workers: int | None) -> Numbers:
    """Return a channel at every sample, from its readings."""
    rows = np.array(readings.reshape(-1, readings.shape[-1]), dtype=np.float64)
    rows[~np.isfinite(rows)] = np.nan
    found = resampling.onto_grid(rows, workers=workers)
    return found.reshape(*readings.shape[:-1], found.shape[-1])


def _readings(channel: npt.NDArray[np.number]) -> tuple[npt.NDArray[np.int64], Numbers] | None:
    """Return the samples that are readings and when they were read, where all records of a channel have the same; None elsewhere."""
    rows = channel.reshape(-1, channel.shape[-1])
    first = readings_of(rows[0]) if rows.size else None
    if first is None:
        return None
    for row in rows[1:]:
        other = readings_of(row)
        if other is None or not np.array_equal(other[0], first[0]):
            return None
    return first


def readings_of(row: npt.NDArray[np.number]) -> tuple[npt.NDArray[np.int64], Numbers] | None:
    """Return the samples of a record that are readings, and the places in it where they were read; None where it holds none.

    A reading is seen at the first sample after it: half a sample after it on average, unless all come in one beat with the samples. Where
    they are seen when those of an even clock are, they are the clock's.
    """
    beginning = row[:_LOOKED_AT]
    if np.count_nonzero(beginning[1:] == beginning[:-1]) < _STILL * (beginning.size - 1):
        return None
    steps = np.diff(row)
    changes = np.flatnonzero(np.isfinite(steps) & (steps != 0)) + 1
    if changes.size < _FEWEST:
        return None
    sizes = np.abs(steps[changes - 1].astype(np.float64))
    runs = np.diff(changes)
    usual = float(np.median(runs))
    if not _LEAST <= usual <= _MOST or np.median(sizes) < _STEPS * sizes.min():
        return None
    hold = float(runs[np.abs(runs - usual) <= 1].mean())
    counts = np.maximum(np.rint(runs / hold).astype(np.int64), 1)
    in_beat = np.abs(runs - hold * counts) < max(1.0, _JITTER * hold)
    if in_beat.mean() < _IN_BEAT or changes.size < _OFTEN * row.size / hold:
        return None
    numbers = np.concatenate([[0], np.cumsum(counts)])
    own = _clock(changes, numbers)
    # What stays the same is read all the same.
    every = np.arange(numbers[-1] + 1)
    last = np.searchsorted(numbers, every, side="right") - 1
    if own is None:
        is_exact = np.mean(runs == round(hold) * counts) >= _IN_BEAT
        samples = changes[last] + np.rint(hold * (every - numbers[last])).astype(np.int64)
        return samples, samples - (0.0 if is_exact else 0.5)
    start, hold = own
    places = start + hold * every
    return np.ceil(places - _SAME).astype(np.int64), places


def _clock(changes: npt.NDArray[np.int64], numbers: npt.NDArray[np.int64]) -> tuple[float, float] | None:
    """Return the place of the first reading and samples from one to the next, if an even clock explains where changes are seen."""
    hold = float(changes[-1] - changes[0]) / float(numbers[-1])
    whole = round(hold)
    # Over the whole record a clock that is off by less than a sample is even.
    if np.array_equal(changes - changes[0], whole * numbers):
        return float(changes[0]), float(whole)
    fitted = np.polynomial.Polynomial.fit(numbers, changes, 1)
    hold = float(fitted.deriv()(0.0))
    begins = changes - hold * numbers
    earliest, latest = float(begins.max()) - 1, float(begins.min())
    return ((earliest + latest) / 2, hold) if earliest <= latest + _OFF else None
