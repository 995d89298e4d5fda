"""One live session: rows come in, go through the clock and the stream, and parameters go out with the stamps of their samples."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._live.clock import LiveClock
from tvident._live.rate import Row
from tvident._stream import IdentificationStream, StreamedIdentification

Show = Callable[[Sequence[float], dict[str, npt.NDArray[Any]]], None]


class Session:
    """A stream that is fed from a clock.

    Parameters
    ----------
    stream : IdentificationStream
    period : float
        Nominal seconds from sample to sample.
    shows : sequence of callable
        Called with times and columns.
    """

    def __init__(self, stream: IdentificationStream, period: float, shows: Sequence[Show]) -> None:
        self._stream = stream
        self._period = period
        self._shows = shows
        self._stamps: list[float] = []
        self._first = 0
        self.clock = LiveClock(period)
        self.given = 0

    def take(self, rows: Sequence[Sequence[float]], *, has_counter: bool) -> None:
        """Take rows of a time, an angle, a torque and perhaps a counter."""
        ready: list[Row] = []
        for row in rows:
            time, angle, torque = row[:3]
            ready += self.clock.rows((time, angle, torque), row[3] if has_counter else None)
        self._push(ready)

    def finish(self) -> None:
        """End the stream."""
        self._push(self.clock.rest())
        self._show(self._stream.finish())

    def _push(self, rows: Sequence[Row]) -> None:
        if not rows:
            return
        self._stamps += [row[0] for row in rows]
        angles, torques = (np.array([row[place] for row in rows], dtype=np.float64) for place in (1, 2))
        self._show(self._stream.push(angles, torques))

    def _show(self, out: StreamedIdentification) -> None:
        count = out.time.size
        if not count:
            return
        places = np.round(out.time / self._period).astype(int)
        stamps = [self._stamp(place) for place in places.tolist()]
        columns: dict[str, npt.NDArray[Any]] = {}
        for name, values in out.values.items():
            columns |= {name: values, f"{name}_stderr": out.stderr[name]}
        columns["status"] = out.status
        for show in self._shows:
            show(stamps, columns)
        self.given += count
        done = places[-1] + 1 - self._first
        del self._stamps[:done]
        self._first += done

    def _stamp(self, place: int) -> float:
        """Return the stamp of a sample, or its time from the first one on where it has none."""
        stamp = self._stamps[place - self._first]
        return place * self._period if math.isnan(stamp) else stamp

    def words(self) -> list[str]:
        """Return what there is to say in the end."""
        delay = self._stream.delay
        late = 1000 * delay * self._period
        return [
            f"samples: {self._stream.samples} taken in, parameters of {self.given} given, each {delay} samples ({late:.4g} ms) late",
            *self.clock.words(),
        ]
