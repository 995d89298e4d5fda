"""Missing samples of a uniform clock: short gaps that splines go over, and the order of these, by what they miss of samples left out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._clocks.grid import Numbers

_ORDERS = (1, 3, 5)
"""What there is to choose from."""

_MOST_LOST = 2
"""Samples in a row that may be bridged, at most."""

LEAST_BRIDGED = 1.5
"""Periods: steps up to this are no gaps, whatever the channels do."""

_LOOKED_AT, _RECORDS = 1 << 13, 4
"""Samples of the middle of a record, and records, that decide."""

_APART = 8
"""Samples between those that are left out, for each of them."""

_TEST_FUNCTION = 32
"""Samples of a usual test function: a gap that is not bridged takes as many equations."""

_FEW = 0.1
"""Part of the equations, as more of those that are left: if gaps take less than this, they are left out."""

_SEEN, _LEAST = 1e-3, 1e-24
"""What splines may miss of a channel's root mean square whatever its noise is; of its mean square, what is rounding."""

_Rows = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Bridge:
    """How short gaps are bridged.

    Parameters
    ----------
    order : int
        Of the splines.
    longest : float
        The longest step in periods that they go over.
    """

    order: int
    longest: float


def bridge_of(channels: Mapping[str, npt.NDArray[np.number]], order: int | None = None) -> Bridge:
    """Return how short gaps of channels on a uniform grid are bridged; NaN is missing.

    Samples are left out, as many in a row as are missing. What splines miss them by beyond what the noise makes that is an error of theirs.
    It is worth what it saves where it adds less to the variance of equations than these lose with every equation over a gap.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (*, n)
    order : int, optional
        Of the splines, where it is given.
    """
    every = np.concatenate([_rows_of(values) for values in channels.values()])
    first = max(0, (every.shape[1] - _LOOKED_AT) // 2)
    rows = every[:, first : first + _LOOKED_AT]
    squares = np.array([_mean(row**2) for row in rows])
    missed = {one: _missed(rows, one, 1) for one in (_ORDERS if order is None else (order,))}
    known = [found + _LEAST * squares + np.finfo(float).tiny for found, _ in missed.values()]
    best = list(missed)[int(np.argmin([np.nansum(np.log(one)) for one in known]))]
    variance = np.array([_core.noise(np.ascontiguousarray(row), 0.0)[0].sigma ** 2 for row in rows])
    # A record of which hardly a window is whole: then nothing is an error of the splines.
    variance = np.where(np.isfinite(variance), variance, missed[best][0] / missed[best][1])
    for lost in range(1, _MOST_LOST + 1):
        wrong, of_noise = missed[best] if lost == 1 else _missed(rows, best, lost)
        beyond = np.maximum(wrong - variance * of_noise, 0.0)
        gaps = np.array([_gaps(row, lost) for row in every])
        costs = lost * gaps * beyond
        is_worth = (beyond <= _SEEN**2 * squares) | (costs <= variance * np.expm1(_TEST_FUNCTION * gaps))
        if not (is_worth | ~np.isfinite(wrong)).all():
            return Bridge(best, max(float(lost), LEAST_BRIDGED))
    return Bridge(best, float(_MOST_LOST + 1))


def _rows_of(values: npt.NDArray[np.number]) -> _Rows:
    """Return some records of a channel, NaN where nothing is known."""
    rows = np.array(values.reshape(-1, values.shape[-1])[:_RECORDS], dtype=np.float64)
    rows[~np.isfinite(rows)] = np.nan
    return rows


def _missed(rows: _Rows, order: int, lost: int) -> tuple[Numbers, float]:
    """Return the mean squares by which so many samples in a row that are left out are missed, and of noise of variance one."""
    samples = rows.shape[1]
    noise = np.random.default_rng(0).standard_normal((1, samples))
    left_out = np.arange(samples) % (_APART * lost) >= (_APART - 1) * lost
    places = np.arange(samples, dtype=np.float64)
    resampling = _core.Resampling(places, samples, order=order, bridged=lost + 1.0)
    whole = np.concatenate([rows, noise])
    found = resampling.onto_grid(np.where(left_out, np.nan, whole), workers=1)
    wrong = np.array([_mean(row) for row in (found - whole)[:, left_out] ** 2])
    return wrong[:-1], float(wrong[-1])


def _gaps(row: Numbers, lost: int) -> float:
    """Return how many gaps of so many samples there are for each sample."""
    there = np.flatnonzero(np.isfinite(row))
    return int(np.count_nonzero(np.diff(there) == lost + 1)) / max(row.size, 1)


def _mean(values: Numbers) -> float:
    """Return the mean of what is known; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else math.nan


@dataclass(frozen=True)
class Bridged:
    """Channels whose short gaps are bridged.

    Parameters
    ----------
    channels : mapping of str to ndarray
    passed : mapping of str to PassedNoise
        What white noise became, of channels with short gaps.
    settings : mapping
        What settings keep.
    words : str
        What was done.
    """

    channels: Mapping[str, npt.NDArray[np.number]]
    passed: Mapping[str, _core.PassedNoise]
    settings: dict[str, float | str]
    words: str


def bridged(
    channels: Mapping[str, npt.NDArray[np.number]], earlier: Mapping[str, object] | None, workers: int | None
) -> Bridged | None:
    """Return channels of a uniform clock with their short gaps bridged; None where there are none, or they are better left out.

    Samples that are there stay as they are. Where gaps are so rare that they take hardly any equations, they are left out.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (*, n)
        NaN where samples are missing.
    earlier : mapping, optional
        Settings of an earlier result: what they say of bridges is done.
    workers : int, optional
    """
    missing = {name: ~np.isfinite(values) for name, values in channels.items() if values.dtype.kind == "f"}
    missing = {name: gone for name, gone in missing.items() if gone.any()}
    some = {name: channels[name] for name, gone in missing.items() if _saved(gone) > 0}
    if not some:
        return None
    bridge = _earlier(earlier)
    if bridge is None:
        if all(_saved(missing[name]) < _FEW for name in some):
            return None
        bridge = bridge_of(some)
    if bridge.longest < _MOST_LOST:
        return None
    found, passed, filled, lost = dict(channels), {}, 0, 0
    for name, values in some.items():
        samples = values.shape[-1]
        places = np.arange(samples, dtype=np.float64)
        resampling = _core.Resampling(places, samples, order=bridge.order, bridged=bridge.longest)
        known = np.where(missing[name], np.nan, values)
        found[name] = np.where(missing[name], resampling.onto_grid(known, workers=workers), values)
        # Of a batch the record of which most is missing: it passes most noise.
        rows = missing[name].reshape(-1, samples)
        there = np.flatnonzero(~rows[int(rows.sum(axis=1).argmax())]).astype(np.float64)
        passed[name] = _core.Resampling(there, samples, order=bridge.order, bridged=bridge.longest).passed_noise(
            workers=workers
        )
        filled += int(np.count_nonzero(missing[name] & np.isfinite(found[name])))
        lost += int(np.count_nonzero(missing[name]))
    words = (
        f"{filled} of {lost} missing values lie in gaps of up to {math.floor(bridge.longest) - 1} samples, which were bridged by splines "
        f"of order {bridge.order}"
    )
    return Bridged(found, passed, {"spline_order": bridge.order, "bridged": bridge.longest}, words)


def _saved(missing: npt.NDArray[np.bool_]) -> float:
    """Return how many equations short gaps take, for each that they leave: of the record of a channel where they take most."""
    rows = missing.reshape(-1, missing.shape[-1])
    gaps = (sum(_gaps(row, lost) for lost in range(1, _MOST_LOST + 1)) for row in np.where(rows, np.nan, 0.0))
    return math.expm1(_TEST_FUNCTION * max(gaps))


def _earlier(settings: Mapping[str, object] | None) -> Bridge | None:
    """Return what settings of an earlier result say of bridges; None where they say nothing."""
    if settings is None or settings.get("times") not in {None, "lost"}:
        return None
    order, longest = settings.get("spline_order"), settings.get("bridged")
    if not isinstance(order, int) or order not in _ORDERS or not isinstance(longest, int | float) or longest <= 0:
        return None
    return Bridge(order, float(longest))
