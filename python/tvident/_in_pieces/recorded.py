"""The channels of a long recording, read piece by piece in the units of results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import FileError, printable
from tvident._identify import Held, Span
from tvident._in_pieces.file_rows import SourceChannel
from tvident._in_pieces.kept import mark_of
from tvident._units import Axis, axis_of
from tvident._units import Channel as Said

_TIMES_AT_ONCE = 1 << 20

_JITTER = 1e-3
"""Of the sample period: how far times may lie from a uniform grid, as where arrays are taken."""


@dataclass(frozen=True)
class RecordingOfFile:
    """Angle and torque of a record that is not in memory.

    Parameters
    ----------
    angle, torque : SourceChannel
    samples : int
    begin, period : float
        Seconds: of the first sample, and from one to the next.
    axis : Axis
        What the channels are multiplied by.
    weights : SourceChannel, optional
        Of the samples.
    opened : (Path, str), optional
        The file that is read, and what told it from others when it was opened.
    """

    angle: SourceChannel
    torque: SourceChannel
    samples: int
    begin: float
    period: float
    axis: Axis
    weights: SourceChannel | None = None
    opened: tuple[Path, str] | None = None

    @property
    def assumed(self) -> dict[str, str]:
        """Those of angle and torque of which nobody said the unit, and what they are taken for."""
        units = self.axis.system.units
        return {name: units[name] for name in ("angle", "torque") if name in self.axis.assumed}

    def held(self, spans: Sequence[Span]) -> Held:
        """Read some parts."""
        channels = [(self.angle, self.axis.angle), (self.torque, self.axis.torque)]
        if self.weights is not None:
            channels.append((self.weights, 1.0))
        each: list[list[npt.NDArray[Any]]] = [[] for _ in channels]
        for span in spans:
            for (channel, factor), parts in zip(channels, each, strict=True):
                parts.append(self._scaled(channel.read(*span), factor))
        angle, torque, *weights = (parts[0] if len(parts) == 1 else np.concatenate(parts) for parts in each)
        return Held(angle, torque, spans, *weights)

    @staticmethod
    def _scaled(samples: npt.NDArray[Any], factor: float) -> npt.NDArray[Any]:
        native = samples.astype(samples.dtype.newbyteorder("="), copy=False)
        return native if factor == 1 else native.astype(np.float64) * factor

    def check_unchanged(self) -> None:
        """Check that all pieces were read of one recording.

        Raises
        ------
        FileError
            If the file is another than when it was opened.
        """
        if self.opened is not None:
            check_same(*self.opened)

    def times(self, first: int, end: int, step: int) -> npt.NDArray[np.float64]:
        """Return the times of every `step`-th of some samples: of those whose numbers are its multiples."""
        return self.begin + np.arange(first + -first % step, end, step, dtype=np.float64) * self.period


def check_same(path: Path, mark: str) -> None:
    """Check that a file is still what it was.

    Raises
    ------
    FileError
        If it is not.
    """
    if not path.exists() or mark_of(path) != mark:
        raise FileError(
            f"{printable(path)}: must stay as it is while it is read; it was written to or removed; call again when it is complete"
        )


def units_of(angle: str, torque: str, angle_unit: str | None, torque_unit: str | None) -> Axis:
    """Return how channels are converted, by the units that are given or else those of the file."""
    nothing = np.zeros(1)
    return axis_of(Said(nothing, angle), Said(nothing, torque), angle_unit=angle_unit, torque_unit=torque_unit)


def uniform(times: SourceChannel, samples: int, factor: float, name: str) -> tuple[float, float]:
    """Return the first of the times of a record and their step, in seconds.

    Raises
    ------
    ValueError
        If they are not uniform: the message names the first that is not where it should be.
    """
    ends = [float(times.read(place, place + 1)[0]) * factor for place in (0, samples - 1)]
    period = (ends[1] - ends[0]) / max(samples - 1, 1)
    if not (np.isfinite(period) and period > 0):
        raise ValueError(f"times must rise; channel {name!r} goes from {ends[0]:g} to {ends[1]:g} s; sort the samples")
    for first in range(0, samples, _TIMES_AT_ONCE):
        end = min(first + _TIMES_AT_ONCE, samples)
        found = times.read(first, end).astype(np.float64) * factor
        away = np.abs(found - (ends[0] + period * np.arange(first, end)))
        # What digits a time was written with depends on how large it is.
        rounding = 4 * np.finfo(found.dtype).eps * max(abs(ends[0]), abs(ends[1]))
        if not (away <= max(_JITTER * period, rounding)).all():
            place = first + int(np.flatnonzero(~(away <= max(_JITTER * period, rounding)))[0])
            raise ValueError(
                f"times of a long recording must be uniform to a thousandth of their step; in channel {name!r} sample {place} at "
                f"{found[place - first]:.9g} s is {away[place - first] / period:.3g} steps off; give sample_rate= where only the stamps "
                "jitter, or resample"
            )
    # Times with few digits give a rate with many.
    rate = 1 / period
    return ends[0], 1 / round(rate) if rate and abs(rate - round(rate)) < 1e-6 * rate and round(rate) else period


def period_of(delta: float | None, sample_rate: float | None) -> float:
    """Return the sample period that is given."""
    return arguments.sample_period(2, delta=delta, sample_rate=sample_rate)
