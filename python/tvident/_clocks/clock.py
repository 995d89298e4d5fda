"""Channels of a record on one uniform grid: by splines where times jitter, by number where only the stamps do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._clocks.grid import Grid, neighbours, weights_on_grid
from tvident._clocks.missing import LEAST_BRIDGED, bridge_of
from tvident._clocks.order import chosen_order, longest_bridged
from tvident._clocks.packets import evened_packets
from tvident._clocks.passed import Passed

Numbers = npt.NDArray[np.float64]

Kind = Literal["lost", "true", "even"]
"""Times of a uniform clock that lost samples; true ones that jitter; those of samples that were taken evenly, whatever their stamps say."""

_TELLS = 2.0
"""A channel is smoother in one way than in the other where its noise there has so much less variance."""

_AGAINST = 0.25
"""A channel that is mostly noise tells little: it speaks against one that tells much from this power of the other's ratio on."""

_FEWEST, _COMPARED = 64, 1 << 15
"""Samples whose roughness is compared, at least and at most."""

_APART, _OF_NOISE = 0.5, 1 << 13
"""Where all steps are at least so many periods, so many samples of noise tell a ratio to some 5 %. Where samples lie closer, splines
amplify noise so much there that few places make most of its variance."""


@dataclass(frozen=True)
class Clock:
    """How the channels of a record are brought onto a uniform grid.

    Parameters
    ----------
    grid : Grid
    kind : {"lost", "true", "even"}
    order : int
        Of the splines.
    words : str
        What was done.
    doubt : str
        What is wrong with the times; empty where nothing is.
    passed : Passed, optional
        What white noise becomes on the grid, where that has been asked for.
    """

    grid: Grid
    kind: Kind
    order: int
    words: str = ""
    doubt: str = ""
    passed: Passed | None = field(default=None, repr=False, compare=False)

    @property
    def period(self) -> float:
        """Seconds from one sample of the grid to the next."""
        return self.grid.even_period if self.kind == "even" else self.grid.period

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep."""
        return {"times": self.kind, "spline_order": self.order, "bridged": self.grid.bridged}

    def evened(self, channels: Mapping[str, npt.NDArray[np.number]], *, propagate: bool, workers: int | None) -> Evened:
        """Return channels on the grid, and what that does to their noise."""
        grid = self.grid
        if self.kind == "even":
            places = grid.numbers.astype(np.float64)
            resampling, samples = _by_number(places, propagate=propagate)
            passed = None
        else:
            places, samples = grid.places, grid.samples
            resampling = _core.Resampling(places, samples, order=self.order, bridged=grid.bridged, propagate=propagate)
            passed = self.passed or Passed(resampling, workers)
        found = _together(resampling, channels, workers)
        return Evened(found, grid.start + self.period * np.arange(samples, dtype=np.float64), places, passed)


@dataclass(frozen=True)
class Evened:
    """Channels on a uniform grid.

    Parameters
    ----------
    channels : mapping of str to ndarray
    time : ndarray
        In seconds.
    places : ndarray
        Where the record's samples lie, in periods.
    passed : Passed, optional
        What white noise became; None where samples stayed as they are.
    """

    channels: Mapping[str, Numbers]
    time: Numbers
    places: Numbers
    passed: Passed | None

    def known(self, values: Any) -> Any:
        """Return what is known at every sample on the grid, along straight lines; anything else as it is."""
        if isinstance(values, str) or np.ndim(values) == 0 or np.shape(values)[-1] != self.places.size:
            return values
        rows = np.asarray(values, dtype=np.float64)
        grid = np.arange(self.time.size, dtype=np.float64)
        found = [np.interp(grid, self.places, row) for row in rows.reshape(-1, rows.shape[-1])]
        return np.reshape(found, (*rows.shape[:-1], grid.size))

    def weights(self, given: Numbers, *, propagate: bool) -> Numbers:
        """Return weights on the grid; where missing values propagate, those beside samples without any are zero."""
        return weights_on_grid(self.places, given, self.time.size, left_out=propagate)

    def mask(self, mask: npt.NDArray[np.bool_] | None) -> npt.NDArray[np.bool_] | None:
        """Return where on the grid the samples on both sides may be used."""
        if mask is None:
            return None
        left, right = neighbours(self.places, np.arange(self.time.size, dtype=np.float64))
        return np.asarray(mask[..., left] & mask[..., right])


def _by_number(numbers: Numbers, *, propagate: bool) -> tuple[_core.Resampling, int]:
    """Return how samples that were taken evenly are brought onto the grid of their numbers, and how many it has."""
    samples = int(numbers[-1]) + 1
    return _core.Resampling(numbers, samples, order=1, bridged=1.5, propagate=propagate), samples


def _together(
    resampling: _core.Resampling, channels: Mapping[str, npt.NDArray[np.number]], workers: int | None
) -> dict[str, Numbers]:
    """Return channels on the grid, by splines whose equations are factored once for all of them."""
    if not channels:
        return {}
    rows = {name: values.reshape(-1, values.shape[-1]) for name, values in channels.items()}
    every = resampling.onto_grid(np.concatenate(list(rows.values()), dtype=np.float64), workers=workers)
    parts = np.split(every, np.cumsum([len(one) for one in rows.values()])[:-1])
    shapes = [values.shape[:-1] for values in channels.values()]
    return {name: part.reshape(*shape, -1) for name, part, shape in zip(rows, parts, shapes, strict=True)}


def clock_of(
    grid: Grid,
    channels: Mapping[str, npt.NDArray[np.number]],
    quantisation: float | None,
    workers: int | None,
    earlier: Mapping[str, Any] | None = None,
) -> Clock:
    """Return how channels are brought onto a grid: in their own time, or by number where they are smooth in that.

    Settings of an earlier result that hold a clock say what is done; what is wrong with the times is said again.

    Raises
    ------
    TypeError
        If settings hold no order of splines.
    """
    kind = None if earlier is None else earlier.get("times")
    if earlier is None or kind not in {"true", "even", "lost"} or (kind == "lost" and grid.jitter > 0):
        return _told(*_splines(grid, channels, {}), channels, quantisation, workers)
    order = earlier.get("spline_order")
    if order not in {0, 1, 3, 5, 7}:
        raise TypeError(f"spline_order of settings must be 0, 1, 3, 5 or 7; got {order!r}; pass result.settings")
    return _as_earlier(_told(*_splines(grid, channels, earlier), channels, quantisation, workers), kind, order)


def _splines(
    grid: Grid, channels: Mapping[str, npt.NDArray[np.number]], earlier: Mapping[str, Any]
) -> tuple[Grid, int]:
    """Return the grid with the longest step that splines go over, and their order: what settings hold, and otherwise what is best."""
    order, given = earlier.get("spline_order"), earlier.get("bridged")
    bridged = float(given) if isinstance(given, int | float) and given > 0 else None
    if grid.jitter == 0 and not (order and bridged):
        bridge = bridge_of({name: grid.with_missing(values) for name, values in channels.items()}, order)
        return replace(grid, bridged=bridged or bridge.longest), bridge.order
    order = order or chosen_order(grid, channels)
    # Where the earlier record had no longer steps, nothing is known of them.
    if bridged is None or bridged <= LEAST_BRIDGED:
        bridged = longest_bridged(grid, channels, order)
    return replace(grid, bridged=bridged), order


def _told(
    grid: Grid,
    order: int,
    channels: Mapping[str, npt.NDArray[np.number]],
    quantisation: float | None,
    workers: int | None,
) -> Clock:
    """Return what times are like, and what is done with them by splines of an order."""
    packets = evened_packets(grid, channels)
    if packets is not None:
        grid, name = packets
        return _even(
            grid,
            f"stamps come in packets, but the {name} goes on within and between them as in sample number, not in time",
        )
    if grid.jitter == 0:
        return Clock(grid, "lost", order, _lost(grid, order))
    share = f"steps of time scatter by {grid.jitter:.2g} of a step"
    clock = Clock(
        grid,
        "true",
        order,
        f"{share}: the channels were brought onto a uniform grid of {1 / grid.period:.6g} Hz by splines of order {order}{_gaps(grid)}",
    )
    said, passed = _smoother(clock, channels, quantisation, workers)
    clock = replace(clock, passed=passed)
    in_number = {name: ratio for name, ratio in said.items() if ratio > _TELLS}
    if not in_number:
        return clock
    against = min(1 / _TELLS, max(in_number.values()) ** -_AGAINST)
    in_time = [name for name, ratio in said.items() if ratio < against]
    if in_time:
        return Clock(
            grid,
            "true",
            order,
            clock.words,
            f"{share}, and the {in_time[0]} is smooth in time, but the {next(iter(in_number))} in sample number: the channels seem to be "
            "of different clocks; do not trust the numbers before each has its own times",
        )
    name, ratio = max(in_number.items(), key=lambda one: one[1])
    noise = f"where its noise is {math.sqrt(ratio):.2g} times as large"
    return _even(grid, f"{share}, but the {name} is smooth in sample number and not in time, {noise}")


def _even(grid: Grid, why: str) -> Clock:
    """Return the clock of samples that were taken evenly, whatever their stamps say."""
    rate = 1 / grid.even_period
    return Clock(
        grid,
        "even",
        0,
        f"samples were taken to be even at {rate:.9g} Hz{_gaps(replace(grid, bridged=grid.longest))}",
        f"{why}: the stamps jitter, not the samples, as behind a buffer; samples were taken to be even; give "
        f"sample_rate={rate:.9g} to say so",
    )


def _as_earlier(clock: Clock, kind: Kind, order: int) -> Clock:
    """Return the clock of an earlier result, with what is wrong with the times now."""
    grid = clock.grid
    if kind == clock.kind:
        return replace(clock, order=order, passed=clock.passed if order == clock.order else None)
    words = "channels were brought onto a uniform grid as in the earlier result"
    if clock.kind == "even":
        doubt = (
            "the earlier result took samples at their times, but these are smooth in sample number and not in time: the stamps jitter, "
            "not the samples, as behind a buffer; do not trust these numbers; leave settings= out, or give sample_rate="
        )
        return Clock(grid, kind, order or 1, words, doubt)
    return Clock(grid, kind, order if kind == "even" else order or 1, words, clock.doubt)


def _lost(grid: Grid, order: int) -> str:
    lost, most = grid.samples - grid.places.size, math.floor(grid.bridged) - 1
    bridged = f": up to {most} in a row were bridged by splines of order {order}" if most > 0 else ""
    return f"the clock is uniform, at {1 / grid.period:.6g} Hz, but {lost} of {grid.samples} samples are not there{bridged}{_gaps(grid)}"


def _gaps(grid: Grid) -> str:
    gaps = int((np.diff(grid.places) > grid.bridged).sum())
    return f"; {gaps} steps of more than {grid.bridged * grid.period:.3g} s are gaps" if gaps else ""


def _smoother(
    clock: Clock, channels: Mapping[str, npt.NDArray[np.number]], quantisation: float | None, workers: int | None
) -> tuple[dict[str, float], Passed | None]:
    """Return the variance of every channel's noise in time over that in sample number; and what white noise becomes, if that is all."""
    whole = clock.grid
    if whole.places.size < _FEWEST:
        return {}, None
    first = max(0, (whole.places.size - _COMPARED) // 2)
    part = slice(first, first + _COMPARED)
    places = whole.places[part] - math.ceil(whole.places[first])
    # Over steps that splines do not follow well, too: where these are many nothing else would be left to compare.
    grid = replace(whole, places=places, samples=math.floor(places[-1]) + 1, bridged=whole.longest)
    # Of a short record without gaps that is what is done with all of it.
    without_gaps = bool(np.diff(places).max() <= min(whole.bridged, whole.longest))
    is_all = without_gaps and grid.samples == whole.samples and np.array_equal(places, whole.places)
    channels = {name: values[..., part] for name, values in channels.items()}
    clock = replace(clock, grid=grid)
    in_time = clock.evened(channels, propagate=False, workers=workers)
    in_number = _together(_by_number(grid.numbers.astype(np.float64), propagate=False)[0], channels, workers)
    passed = _of_noise(clock, in_time.passed, workers)
    gain = 1.0 if passed is None else passed.gain
    found = {}
    for name in channels:
        step = quantisation if name == "angle" else 0.0
        pairs = zip(
            _core.noise(in_time.channels[name], step, passed),
            _core.noise(in_number[name], step),
            strict=True,
        )
        ratios = [(one.sigma / other.sigma) ** 2 / gain for one, other in pairs if other.sigma > 0]
        there = [ratio for ratio in ratios if math.isfinite(ratio) and ratio > 0]
        if there:
            found[name] = float(np.median(there))
    return found, in_time.passed if is_all else None


def _of_noise(clock: Clock, passed: Passed | None, workers: int | None) -> _core.PassedNoise | None:
    """Return what becomes of white noise on a grid: of a part of it, where that tells what has twice the variance of something else."""
    if passed is None or float(np.diff(clock.grid.places).min()) < _APART:
        return None if passed is None else passed.noise
    places = clock.grid.places[:_OF_NOISE]
    part = replace(clock, grid=replace(clock.grid, places=places, samples=math.floor(places[-1]) + 1))
    first = part.evened({}, propagate=False, workers=workers).passed
    return None if first is None else first.in_short()
