"""Angle and torque on clocks of their own: both brought onto one grid, at the rate of the faster, or of the angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._clocks.grid import Grid, Numbers, grid_of
from tvident._clocks.missing import longest_bridged_in
from tvident._clocks.packets import evened_packets
from tvident._clocks.passed import Passed
from tvident._units import times_in_seconds

_ORDER = 5
"""Of the splines."""

_GAP = 1.5
"""Periods of a uniform clock beyond which a step is a gap."""

_SAME = 1e-6
"""Periods by which samples may be off the grid and be its own."""


@dataclass(frozen=True)
class TwoClocks:
    """The clocks of angle and torque, and the grid that both are brought onto.

    Parameters
    ----------
    angle, torque : Grid
        Each channel's own times.
    start, period : float
        Seconds.
    samples : int
        Of the grid, from the first to the last time that both have.
    doubt : str
        What is wrong with stamps; empty where nothing is.
    """

    angle: Grid
    torque: Grid
    start: float
    period: float
    samples: int
    doubt: str = ""

    @property
    def time(self) -> Numbers:
        """Time of every sample of the grid in seconds."""
        return self.start + self.period * np.arange(self.samples, dtype=np.float64)

    @property
    def words(self) -> str:
        """What was done."""
        one, other = 1 / self.angle.period, 1 / self.torque.period
        return (
            f"the angle was sampled at {one:.6g} Hz and the torque at {other:.6g} Hz, each by its own clock: both were brought onto "
            f"a grid of {1 / self.period:.6g} Hz by splines of order {_ORDER}"
        )

    def true_times(self, own: Grid, late: tuple[float, float]) -> Numbers:
        """Return the times of a clock's samples, whose stamps are late by so many seconds, and by how many more each second."""
        times = own.start + own.period * own.places
        offset, drift = late
        return np.asarray(times - offset - drift * (times - self.start))

    def on_grid(
        self, own: Grid, values: npt.NDArray[np.number], late: tuple[float, float] = (0.0, 0.0), *, propagate: bool
    ) -> tuple[Numbers, Passed | None]:
        """Return a channel on the grid, and what that makes of noise.

        Parameters
        ----------
        own : Grid
            Its clock.
        values : ndarray
        late : (float, float)
            By how many seconds its stamps are late at the start of the grid, and by how many more each second.
        propagate : bool
            Nothing is known beside missing values.
        """
        offset, drift = late
        with np.errstate(over="ignore", invalid="ignore"):  # stamps that leave the range of doubles do not go on
            places = (self.true_times(own, late) - self.start) / self.period
            goes_on = bool(np.all(np.diff(places) > 0))
        if not goes_on:
            raise ValueError(
                f"a clock must go on where its stamps are moved; got stamps that are late by {offset:.3g} s and {drift:.3g} s more each "
                "second; give align= in seconds, or times that are right"
            )
        whole = np.rint(places)
        if float(np.abs(places - whole).max()) <= _SAME:
            places = whole
        there = np.isfinite(values)
        longest = max(own.bridged, 0.0 if propagate else longest_bridged_in(values, _ORDER))
        resampled = partial(
            _core.Resampling,
            grid=self.samples,
            order=_ORDER,
            bridged=longest * own.period / self.period,
            propagate=propagate,
        )
        resampling = resampled(places)
        if longest > own.bridged:
            # White noise is taken where samples are.
            return resampling.onto_grid(values), Passed(resampled(places[there]))
        passed = None if places is whole and own.period / self.period < _GAP else Passed(resampling)
        return resampling.onto_grid(values), passed


def two_clocks(
    angle: Any,
    torque: Any,
    channels: Sequence[npt.NDArray[np.number]],
    time_unit: str | None = None,
    *,
    by_angle: bool = False,
) -> TwoClocks:
    """Return the clocks of two channels from times, or from sample rates of channels that begin together.

    Parameters
    ----------
    angle, torque : float or array_like
        Rates, or times.
    channels : sequence of ndarray, shape (n,)
        Samples of angle and torque, which tell whether some were lost.
    time_unit : str, optional
    by_angle : bool, optional
        The grid is the angle's clock, which derivatives are taken of: on the grid of a faster torque its noise would seem to be motion.

    Raises
    ------
    ValueError
        If times do not increase, or share no time.
    """
    read = [_grid(one, samples, time_unit) for one, samples in zip((angle, torque), channels, strict=True)]
    own = [grid for grid, _ in read]
    late = {name: late for name, (_, late) in zip(("angle", "torque"), read, strict=True) if late > 0}
    doubt = "; ".join(
        f"stamps of the {name} come in packets, but its samples go on evenly, as behind a buffer: they were taken to be even, and when the "
        f"first was taken is known to {late:.2g} s only"
        for name, late in late.items()
    )
    start = max(one.start for one in own)
    end = min(one.start + one.period * float(one.places[-1]) for one in own)
    # On the samples of one of the clocks, so that these stay as they are.
    leading = own[0] if by_angle else min(own, key=lambda one: one.period)
    period = leading.period
    if not end - start > period:
        raise ValueError(
            f"the times of angle and torque must overlap; they share {max(0.0, end - start):g} s; check the clocks' units and starts"
        )
    start = leading.start + math.ceil((start - leading.start) / period - _SAME) * period
    return TwoClocks(own[0], own[1], start, period, math.floor((end - start) / period + _SAME) + 1, doubt)


def _grid(times: Any, channel: npt.NDArray[np.number], time_unit: str | None) -> tuple[Grid, float]:
    """Return the clock of one channel, and by how many seconds its stamps may be late where they come in packets and it does not."""
    samples = channel.shape[-1]
    if np.ndim(times) == 0:
        period = arguments.sample_period(samples, sample_rate=times)
        start = 0.0
    else:
        times = times_in_seconds(times, time_unit, has_argument=True)
        try:
            period = arguments.sample_period(samples, t=times)
            arguments.check_no_lost_samples(times, channel)
        except arguments.NotUniformError as error:
            grid = grid_of(error.times)
            evened = evened_packets(grid, {"channel": channel})
            return (grid, 0.0) if evened is None else _even(evened[0])
        start = float(arguments.times_of(times).flat[0])
    return Grid(start, period, samples, np.arange(samples, dtype=np.float64), _GAP, _GAP, 0.0), 0.0


def _even(grid: Grid) -> tuple[Grid, float]:
    """Return the clock of samples that were taken evenly, whose stamps come in packets, and half a packet in seconds."""
    period, numbers = grid.even_period, grid.numbers.astype(np.float64)
    start = grid.start + float(np.mean(grid.period * grid.places - period * numbers))
    packets = 1 if grid.packets is None else grid.packets.size
    half = numbers.size / (packets + 1) / 2 * period
    return Grid(start, period, int(numbers[-1]) + 1, numbers, _GAP, _GAP, 0.0), half
