"""Missing samples of a uniform clock: short gaps that splines go over, and the order of these, by what they miss of samples left out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._clocks.gaps import FEW, LONGEST, USUAL, beyond, gaps_of, is_worth, mean_of, take_many, taken
from tvident._clocks.grid import Numbers
from tvident._clocks.long_gaps import over_long
from tvident._clocks.passed import Passed
from tvident._clocks.timed import Timed

_ORDERS = (1, 3, 5)
"""What there is to choose from."""

LEAST_BRIDGED = 1.5
"""Periods: steps up to this are no gaps, whatever the channels do."""

_LOOKED_AT, _RECORDS = 1 << 13, 4
"""Samples of the middle of a record, and records, that decide."""

_APART = 8
"""Samples between those that are left out, for each of them."""

_LEAST = 1e-24
"""Of the mean square of a channel: what is rounding."""

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


@np.errstate(all="ignore")
def bridge_of(
    channels: Mapping[str, npt.NDArray[np.number]], order: int | None = None, *, alone: bool = False
) -> Bridge:
    """Return how short gaps of channels on a uniform grid are bridged; NaN is missing.

    Samples are left out, as many in a row as are missing. What splines miss them by beyond what the noise makes that is an error of theirs.
    It is worth what it saves where it adds less to the variance of equations than these lose with every equation over a gap.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (*, n)
    order : int, optional
        Of the splines, where it is given.
    alone : bool
        Whether other channels lack nothing: what splines smooth over long gaps, they smooth of one side of the equation then.
    """
    every = np.concatenate([_rows_of(values) for values in channels.values()])
    first = max(0, (every.shape[1] - _LOOKED_AT) // 2)
    rows = every[:, first : first + _LOOKED_AT]
    squares = np.array([mean_of(row**2) for row in rows])
    missed = {one: _missed(rows, one, 1) for one in (_ORDERS if order is None else (order,))}
    known = [found + _LEAST * squares + np.finfo(float).tiny for found, _ in missed.values()]
    best = list(missed)[int(np.argmin([np.nansum(np.log(one)) for one in known]))]
    # Not finite of a record of which hardly a window is whole: then nothing is an error of the splines.
    variance = np.array([_core.noise(np.ascontiguousarray(row), 0.0)[0].sigma ** 2 for row in rows])
    long = None if alone else over_long(every, rows, variance, tuple(missed))
    if long is not None:
        return Bridge(long[0], long[1] + 1.0)
    variance = np.where(np.isfinite(variance), variance, missed[best][0] / missed[best][1])
    for lost in range(1, USUAL + 1):
        wrong, of_noise = missed[best] if lost == 1 else _missed(rows, best, lost)
        gaps = np.array([gaps_of(row, lost, lost) for row in every])
        if not (is_worth(lost, gaps, beyond(wrong, of_noise, variance), variance, squares) | ~np.isfinite(wrong)).all():
            return Bridge(best, max(float(lost), LEAST_BRIDGED))
    return Bridge(best, float(USUAL + 1))


def _rows_of(values: npt.NDArray[np.number]) -> _Rows:
    """Return some records of a channel, NaN where nothing is known."""
    return _records(values.reshape(-1, values.shape[-1])[:_RECORDS])


def _missed(rows: _Rows, order: int, lost: int) -> tuple[Numbers, float]:
    """Return the mean squares by which so many samples in a row that are left out are missed, and of noise of variance one."""
    samples = rows.shape[1]
    noise = np.random.default_rng(0).standard_normal((1, samples))
    left_out = np.arange(samples) % (_APART * lost) >= (_APART - 1) * lost
    places = np.arange(samples, dtype=np.float64)
    resampling = _core.Resampling(places, samples, order=order, bridged=lost + 1.0)
    whole = np.concatenate([rows, noise])
    found = resampling.onto_grid(np.where(left_out, np.nan, whole), workers=1)
    wrong = np.array([mean_of(row) for row in (found - whole)[:, left_out] ** 2])
    return wrong[:-1], float(wrong[-1])


@dataclass(frozen=True)
class Bridged:
    """Channels whose gaps are bridged: short ones, or those between readings that a recorder holds.

    Parameters
    ----------
    channels : mapping of str to ndarray
    passed : mapping of str to Passed
        What white noise became, of channels with such gaps.
    settings : mapping
        What settings keep.
    words : str
        What was done.
    doubts : sequence of str
        What to do.
    """

    channels: Mapping[str, npt.NDArray[np.number]]
    passed: Mapping[str, Passed]
    settings: dict[str, Any]
    words: str
    doubts: Sequence[str] = ()

    def after(self, before: Timed | None) -> Bridged:
        """Return the same with the words and settings of what was done before."""
        if before is None:
            return self
        return replace(self, settings={**before.settings, **self.settings}, words=f"{before.words}; {self.words}")


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
    gappy = {name: values for name, values in channels.items() if values.dtype.kind == "f"}
    gappy = {name: values for name, values in gappy.items() if not np.isfinite(values).all()}
    if not gappy:
        return None
    rows = {name: _records(values) for name, values in gappy.items()}
    given, records = _earlier(earlier), len(next(iter(rows.values())))
    alone = len(gappy) < len(channels)
    bridges = [
        _bridge_of_record({name: row[place] for name, row in rows.items()}, given, alone=alone)
        for place in range(records)
    ]
    longest = max((one.longest for one in bridges if one is not None), default=0.0)
    if not longest:
        return None
    found, passed, filled, lost = dict(channels), {}, 0, 0
    for name, values in gappy.items():
        new = np.stack([_filled(row, bridge, workers) for row, bridge in zip(rows[name], bridges, strict=True)])
        filled += int(np.count_nonzero(np.isfinite(new) & ~np.isfinite(rows[name])))
        lost += int(np.count_nonzero(~np.isfinite(rows[name])))
        found[name] = new.reshape(values.shape)
        worst = int(np.count_nonzero(~np.isfinite(rows[name]), axis=1).argmax())
        # What noise becomes is said of all records, so that records which lack nothing stay as they are alone.
        if all(bridges) and _saved(rows[name][worst]) > 0:
            there = np.flatnonzero(np.isfinite(rows[name][worst])).astype(np.float64)
            passed[name] = Passed(_resampling(there, values.shape[-1], bridges[worst]), workers)
    orders = " and ".join(str(order) for order in sorted({one.order for one in bridges if one is not None}))
    words = (
        f"{filled} of {lost} missing values lie in gaps of up to {math.floor(longest) - 1} samples, which were bridged by splines of order "
        f"{orders}"
    )
    # Every record of a batch has its own.
    own = bridges[0] if records == 1 else None
    settings = {} if own is None else {"spline_order": own.order, "bridged": own.longest}
    return Bridged(found, passed, settings, words)


def longest_bridged_in(values: npt.NDArray[np.number], order: int) -> float:
    """Return the longest step in periods that splines go over in a channel on a uniform clock; 0 where gaps are better left out.

    However rare they are: on the grid of a faster channel a gap is long, and so are test functions.
    """
    row = _records(values)[0]
    bridge = bridge_of({"": row}, order, alone=True) if _saved(row) > 0 else None
    return bridge.longest if bridge is not None and bridge.longest >= USUAL else 0.0


def _records(values: npt.NDArray[np.number]) -> _Rows:
    """Return the records of a channel, NaN where nothing is known."""
    rows = np.array(values.reshape(-1, values.shape[-1]), dtype=np.float64)
    rows[~np.isfinite(rows)] = np.nan
    return rows


def _bridge_of_record(channels: Mapping[str, Numbers], given: Bridge | None, *, alone: bool) -> Bridge | None:
    """Return how short gaps of a record are bridged; None where there are none, or they are better left out."""
    some = {name: row for name, row in channels.items() if _saved(row) > 0}
    if not some or (given is None and max(map(_saved, some.values())) < FEW):
        return None
    bridge = given or bridge_of(some, alone=alone or len(some) < len(channels))
    return bridge if bridge.longest >= USUAL else None


def _filled(row: Numbers, bridge: Bridge | None, workers: int | None) -> Numbers:
    """Return a record with its short gaps bridged; samples that are there stay as they are."""
    if bridge is None:
        return row
    places = np.arange(row.size, dtype=np.float64)
    return np.where(
        np.isfinite(row), row, _resampling(places, row.size, bridge).onto_grid(row[np.newaxis], workers=workers)[0]
    )


def _resampling(places: Numbers, samples: int, bridge: Bridge | None) -> _core.Resampling:
    assert bridge is not None  # noqa: S101 - asked for where there is one
    return _core.Resampling(places, samples, order=bridge.order, bridged=bridge.longest)


def _saved(row: Numbers) -> float:
    """Return how many equations short gaps take, for each that they leave; all gaps, where long ones take many."""
    longest = LONGEST if take_many(gaps_of(row, USUAL + 1, LONGEST)) else USUAL
    return taken(gaps_of(row, 1, longest))


def _earlier(settings: Mapping[str, object] | None) -> Bridge | None:
    """Return what settings of an earlier result say of bridges; None where they say nothing."""
    if settings is None or settings.get("times") not in {None, "lost"}:
        return None
    order, longest = settings.get("spline_order"), settings.get("bridged")
    if not isinstance(order, int) or order not in _ORDERS or not isinstance(longest, int | float) or longest <= 0:
        return None
    return Bridge(order, float(longest))
