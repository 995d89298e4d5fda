"""Windows chosen where times are not uniform: on a uniform grid, and then used at the samples' own times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._clocks import grid_of
from tvident._derivatives.found import Found
from tvident._derivatives.plans import SHORTEST_WINDOW, sliding_window
from tvident._status import Status

Numbers = npt.NDArray[np.float64]

_ORDER = 3
"""Of the splines that bring samples onto the grid: higher ones amplify noise more where steps are long."""

_CLOSE = 0.5
"""Periods: of samples that are closer to each other, splines would make steep slopes of their noise."""


_MOST_SCATTER = 1.5
"""Of steps, as :attr:`Grid.jitter` has it: beyond, splines over long steps tell nothing of windows."""


@dataclass(frozen=True)
class _TimedEstimates:
    """One derivative at every sample of a record, and what else is known of its windows."""

    value: Numbers
    error: Numbers
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]
    sigma: Numbers

    @classmethod
    def none(cls, shape: tuple[int, ...]) -> _TimedEstimates:
        """Return arrays in which nothing is known yet."""
        value, error, sigma = (np.full(shape, np.nan) for _ in range(3))
        return cls(value, error, np.zeros(shape, np.uint8), np.full(shape, Status.INVALID, np.uint16), sigma)

    def take(self, some: Any, other: _TimedEstimates, places: Any) -> None:
        """Take over some places from another."""
        for name, values in vars(self).items():
            values[some] = getattr(other, name)[places]


@dataclass(frozen=True)
class _TimedWindows:
    """Windows with polynomials of one order, at the times of a record.

    Parameters
    ----------
    times : ndarray, shape (n,)
    period : float
        Seconds from sample to sample, on average.
    length, order, derivative : int
        Samples of a window on average.
    quantisation : float
    """

    times: Numbers
    period: float
    length: int
    order: int
    derivative: int
    quantisation: float

    def plan(self, *, at_end: bool = False, by_count: bool = False) -> _core.WindowFit:
        """Return the plan of windows of one duration, or number of samples; near the ends a lower order may be better."""
        order = min(self.order, self.length - 1)
        return _core.WindowFit(
            self.times - self.times[0],
            self.length if by_count else self.length * self.period,
            order=None if at_end else order,
            max_order=order,
            criterion="aicc",
            derivatives=self.derivative,
            quantisation=self.quantisation,
        )

    def of(self, record: npt.NDArray[np.number], workers: int | None) -> _TimedEstimates:
        """Return the estimates of a record without gaps: with the order of the whole record, but near its ends."""
        found = self._fitted(record, workers)
        seconds = self.length * self.period
        first, half, last, rest = np.searchsorted(
            self.times, self.times[[0, 0, -1, -1]] + seconds * np.array([1.0, 0.5, -1.0, -0.5])
        )
        for window, part in ((slice(0, first), slice(0, half)), (slice(last, None), slice(rest, None))):
            at_end = replace(self, times=self.times[window])._fitted(record[window], workers, at_end=True)  # noqa: SLF001 - of this class
            inside = slice(part.start - window.start, None if part.stop is None else part.stop - window.start)
            found.take(part, at_end, inside)
        # Where few samples lie in so many seconds, so many samples take longer.
        lost = np.isnan(found.value)
        if lost.any():
            found.take(lost, self._fitted(record, workers, by_count=True), lost)
        return found

    def between_gaps(self, record: npt.NDArray[np.number], workers: int | None) -> _TimedEstimates:
        """Return the estimates of all parts of a record between steps that are longer than half a window."""
        samples = self.times.size
        found = _TimedEstimates.none((samples,))
        borders = [0, *(np.flatnonzero(np.diff(self.times) > self.length // 2 * self.period) + 1).tolist(), samples]
        for first, end in pairwise(borders):
            length = min(self.length, (end - first - 1) // 2 * 2 + 1)
            if length < SHORTEST_WINDOW:
                continue
            part = replace(self, times=self.times[first:end], length=length).of(record[first:end], workers)
            found.take(slice(first, end), part, slice(None))
        return found

    def _fitted(self, record: npt.NDArray[np.number], workers: int | None, **how: bool) -> _TimedEstimates:
        fitted = self.plan(**how).estimate(record, errors=True, workers=workers)
        found, last = fitted.estimates, self.derivative
        assert fitted.stderr is not None  # noqa: S101 - asked for
        return _TimedEstimates(found.derivatives[last], fitted.stderr[last], found.order, found.status, found.sigma)


def choose_at_own_times(
    samples: npt.NDArray[np.number],
    times: Numbers,
    choose_on: Callable[..., Found],
    *,
    quantisation: float,
    step: int,
    workers: int | None,
    progress: arguments.Progress,
) -> Found:
    """Choose window and order for every record and derivative, and estimate at the samples' own times.

    Parameters
    ----------
    samples : ndarray, shape (*, n)
    times : ndarray, shape (n,)
    choose_on : callable
        Chooses for records on a uniform grid, with its period as `delta`.
    quantisation, step, workers, progress
        As users give them.
    """
    grid = grid_of(times)
    if grid.jitter > _MOST_SCATTER:
        raise ValueError(
            f"window_length='auto' needs steps of t that scatter by no more than {_MOST_SCATTER} of a step; they scatter by "
            f"{grid.jitter:.2g}; give a duration such as '0.2 s'"
        )
    apart = _apart(grid.places)
    onto = _core.Resampling(grid.places[apart], grid.samples, order=_ORDER, bridged=grid.bridged)
    chosen = choose_on(onto.onto_grid(np.ascontiguousarray(samples[..., apart]), workers=workers), delta=grid.period)
    lengths = np.array(chosen.window_length)
    for at, length in np.ndenumerate(lengths):
        lengths[at] = sliding_window(int(length), grid.samples)
    orders = np.array(chosen.settings["order"]).reshape(lengths.shape)

    def windows(derivative: int, index: tuple[int, ...]) -> _TimedWindows:
        at = (derivative, *index)
        # A record of nothing but missing values has no window; any will do to say so.
        length = min(int(lengths[at]) or SHORTEST_WINDOW, (times.size - 1) // 2 * 2 + 1)
        return _TimedWindows(times, grid.period, length, int(orders[at]), derivative, quantisation)

    shape = (len(lengths), *samples.shape)
    found = _TimedEstimates.none(shape)
    with arguments.reporter(progress, "local polynomials") as report:
        for done, at in enumerate(np.ndindex(shape[:-1])):
            one = windows(at[0], at[1:]).between_gaps(samples[at[1:]], workers)
            found.take(at, one, slice(None))
            if report is not None:
                report(times.size * (done + 1) // max(1, lengths.size), times.size)
    return replace(
        chosen,
        window_length=lengths,
        settings=chosen.settings | {"window_length": lengths.tolist()},
        derivatives=found.value[..., ::step],
        order=found.order[-1, ..., ::step],
        status=np.bitwise_or.reduce(found.status[..., ::step]),
        sigma=found.sigma[0, ..., ::step],
        errors=lambda: found.error[..., ::step],
        plan_of=lambda index: windows(len(lengths) - 1, index).plan(at_end=True),
    )


def _apart(places: Numbers) -> npt.NDArray[np.intp]:
    """Return which samples lie apart from those before them that are among these."""
    kept, last = [0], float(places[0])
    for number, place in enumerate(places.tolist()):
        if place - last >= _CLOSE:
            kept.append(number)
            last = place
    return np.array(kept)
