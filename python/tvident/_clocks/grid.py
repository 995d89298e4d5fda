"""The uniform grid of times that are not uniform: its period, its gaps, and where on it samples lie."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Numbers = npt.NDArray[np.float64]

_GAP, _RARE, _SHARE = 3.0, 1.5, 0.99
"""A step is a gap where it is longer than so many usual ones and so many times the longest but a hundredth."""

_EVEN = 1e-3
"""Periods by which times of a uniform clock may be off, as everywhere."""

_FEW = (1, 10, 100)
"""Steps of so many periods tell the period to ever more digits."""

_FEW_TIMES = 1 << 12
"""Times that are looked at first: they show most clocks that are not uniform."""

_MOST_GRID = 10
"""Samples of the grid for each that was recorded, at most: beyond, the record is mostly gaps."""

_LEAST_WEIGHT = 1e-100
"""Of the greatest weight: variances stay within the range of doubles."""

_UNIFORM = math.sqrt(6.0)
"""Times that lie anywhere within a step have steps that scatter by the step over this."""


@dataclass(frozen=True)
class Grid:
    """A uniform grid, and the samples of a record on it.

    Parameters
    ----------
    start, period : float
        Seconds.
    samples : int
        Of the grid.
    places : ndarray, shape (n,)
        Times of the record's samples in periods from the start on.
    longest : float
        The longest step in periods that is no gap of the record.
    bridged : float
        The longest step in periods that splines go over: as long, or shorter where they do not predict what lies in it.
    jitter : float
        By how much steps scatter, as the share of a period within which times that scatter so lie; 0 where samples lie on the grid.
    packets : ndarray, optional
        The sample after every pause between packets, where stamps come in packets and samples do not.
    """

    start: float
    period: float
    samples: int
    places: Numbers
    longest: float
    bridged: float
    jitter: float
    packets: npt.NDArray[np.intp] | None = None

    @property
    def time(self) -> Numbers:
        """Time of every sample of the grid in seconds."""
        return self.start + self.period * np.arange(self.samples, dtype=np.float64)

    @property
    def even_period(self) -> float:
        """The period of samples that were taken evenly, by least squares of all stamps, or of the centres of whole packets."""
        numbers, places = self.numbers.astype(np.float64), self.places
        if self.packets is not None:
            # A line through steps would be less steep than what they follow.
            whole = slice(self.packets[0], self.packets[-1])
            firsts = self.packets[:-1] - self.packets[0]
            numbers, places = (np.add.reduceat(one[whole], firsts) / np.diff(self.packets) for one in (numbers, places))
        return self.period * float(np.polynomial.Polynomial.fit(numbers, places, 1).deriv()(0.0))

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """Places on the grid of samples that were taken evenly, whatever their times say; gaps count as the samples that they take."""
        steps = np.diff(self.places)
        counts = np.where(steps > self.longest, np.rint(steps), 1).astype(np.int64)
        return np.concatenate([[0], np.cumsum(counts)])

    def with_missing(self, values: npt.NDArray[np.number]) -> Numbers:
        """Return samples that lie on the grid there, NaN where it has none."""
        found = np.full((*values.shape[:-1], self.samples), np.nan)
        found[..., np.rint(self.places).astype(np.int64)] = values
        return found


def in_no_gap(places: Numbers, wanted: Numbers, longest: float) -> npt.NDArray[np.bool_]:
    """Return which wanted places lie between samples that are no farther apart than the longest step that is no gap."""
    left, right = neighbours(places, wanted)
    return np.asarray(places[right] - places[left] <= longest)


def weights_on_grid(places: Numbers, weights: Numbers, samples: int, *, left_out: bool) -> Numbers:
    """Return weights at the samples of a grid: one over the variance along a straight line between the samples that count.

    Parameters
    ----------
    places : ndarray, shape (n,)
        Where samples lie on the grid.
    weights : ndarray, shape (*, n)
        One over the variance of a sample's noise; zero of samples that do not count.
    samples : int
        Of the grid.
    left_out : bool
        Beside samples that do not count nothing counts; what is missing there is known to be left out.
    """
    grid = np.arange(samples, dtype=np.float64)
    rows = weights.reshape(-1, weights.shape[-1])
    found = np.zeros((rows.shape[0], samples))
    for row, one in zip(rows, found, strict=True):
        there = row > 0
        if not there.any():
            continue
        one[:] = 1 / np.interp(grid, places[there], 1 / np.maximum(row[there], _LEAST_WEIGHT * row.max()))
        if left_out:
            left, right = neighbours(places, grid)
            one[~(there[left] & there[right])] = 0
    return found.reshape(*weights.shape[:-1], samples)


def neighbours(places: Numbers, wanted: Numbers) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the last sample at or before every wanted place, and the first at or after it."""
    left = np.clip(np.searchsorted(places, wanted, side="right") - 1, 0, places.size - 1)
    return left, np.clip(np.searchsorted(places, wanted, side="left"), 0, places.size - 1)


def grid_of(times: Numbers) -> Grid:
    """Return the grid of times that increase.

    Times of a uniform clock that lost samples lie on their own grid. Otherwise the period is the mean of the steps that are no gaps.

    Raises
    ------
    ValueError
        If most of the record's time is gaps.
    """
    steps = np.diff(times)
    usual = float(np.median(steps))
    longest = max(_GAP * usual, _RARE * float(np.quantile(steps, _SHARE, method="lower")))
    lost = _with_lost_samples(times, steps, usual)
    # Packets whose stamps are few counts of a clock apart within them are no clock that lost nearly all samples.
    if lost is not None and (lost[1][-1] < _MOST_GRID * times.size or float(steps.max()) > longest):
        period, places = lost
        jitter = 0.0
    else:
        inner = steps[steps <= longest]
        period = float(inner.mean())
        places = (times - times[0]) / period
        jitter = float(np.sqrt(np.mean((inner / period - 1) ** 2))) * _UNIFORM
    samples = math.floor(float(places[-1]) + 1e-6) + 1
    if samples > _MOST_GRID * times.size:
        place = int(steps.argmax()) + 1
        raise ValueError(
            f"t must have no gaps that take nine tenths of the time; steps are {usual:g} s mostly, but the one to t[{place}] is "
            f"{steps[place - 1]:g} s; identify the parts before and after it on their own, or give sample_rate= where a buffer "
            f"stamps even samples{arguments.clock_changed(float(steps[place - 1]))}"
        )
    return Grid(float(times[0]), period, samples, places, longest / period, longest / period, jitter)


def _with_lost_samples(times: Numbers, steps: Numbers, usual: float) -> tuple[float, Numbers] | None:
    """Return the period of a uniform clock that lost samples, and the number of every sample; None where times are of no such clock."""
    period = usual
    # The usual step may be rounded to few digits: short steps tell the period well enough to count what is lost in longer ones, and so on.
    for most in _FEW:
        counts = np.rint(steps / period)
        few = (counts >= 1) & (counts <= most)
        if not few.any():
            return None
        period = float(steps[few].sum() / counts[few].sum())
    printed = arguments.printed_step(times)
    if _are_off_at_sight(times[:_FEW_TIMES], steps[: _FEW_TIMES - 1], period, printed):
        return None
    numbers = _numbers(steps, period)
    fitted = np.polynomial.Polynomial.fit(numbers, times - times[0], 1)
    off = float(np.abs(times - times[0] - fitted(numbers)).max())
    slope = float(fitted.deriv()(0.0))
    allowed = max(_EVEN * slope, printed if printed < slope / 2 else 0.0)
    if off > allowed:
        return None
    exact = float(times[-1] - times[0]) / float(numbers[-1])
    return exact if off <= _EVEN * slope else slope, numbers


def _numbers(steps: Numbers, period: float) -> Numbers:
    """Return the numbers that a uniform clock would give samples with some steps between them."""
    return np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / period), 1))])


def _are_off_at_sight(times: Numbers, steps: Numbers, period: float, printed: float) -> bool:
    """Tell whether some times are certainly of no uniform clock that lost samples.

    Where all lie near a line, none lies farther than twice as much from that through the first and the last of some.
    """
    numbers = _numbers(steps, period)
    slope = float(times[-1] - times[0]) / float(numbers[-1])
    off = float(np.abs(times - times[0] - slope * numbers).max())
    # The slope of all is hardly another, and certainly not twice as large.
    return off > 2 * max(2 * _EVEN * slope, printed)
