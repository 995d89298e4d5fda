"""Channels that a recorder holds, or draws in lines, from reading to reading: splines go from one to the next instead."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import ordinal
from tvident._clocks.grid import Numbers
from tvident._clocks.passed import Passed
from tvident._clocks.readings import Read, knots_of, readings_of

_ORDER = 5
"""Of the splines, as for channels on clocks of their own."""

_GAP = 1.5
"""Readings beyond which a step is a gap."""

_JITTER = 0.45
"""By which part of the usual step steps differ that are no gaps."""

_Channels = Mapping[str, npt.NDArray[np.number]]


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
    settings : mapping
        What settings keep: what a record does not show.
    """

    channels: Mapping[str, npt.NDArray[np.number]]
    passed: Mapping[str, Passed]
    words: str
    doubt: str
    settings: dict[str, Any]


def unheld(
    channels: Mapping[str, npt.NDArray[np.number]], period: float, workers: int | None, *, of_torque: bool = False
) -> Unheld | None:
    """Return channels without what a recorder made between two readings; None where it made nothing.

    A machine moves between two readings, so what an angle holds there is its recorder's. A torque that is held may be what acts, as that of
    a digital controller, and stays as it is, unless both channels were read at once, or `of_torque` says that it was read. No mass moves
    along straight lines from reading to reading; but what was done to both channels alike changes no equation.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (*, n)
        The angle and the torque among them.
    period : float
        Seconds from one sample to the next.
    workers : int, optional
    of_torque : bool
    """
    both = {name: channels[name] for name in ("angle", "torque")}
    held, drawn = _of_both(readings_of, both), _of_both(knots_of, both)
    if not (of_torque or _are_alike(held)):
        held.pop("torque", None)
    is_drawn_alike = _are_alike(drawn)
    drawn = {name: read for name, read in drawn.items() if name == "angle" and not is_drawn_alike}
    if not held and not drawn:
        return None
    seen, passed = dict(channels), {}
    for name, read in {**held, **drawn}.items():
        bridged = _GAP * math.ceil(np.median(np.diff(read.places)))
        resampling = _core.Resampling(read.places, both[name].shape[-1], order=_ORDER, bridged=bridged)
        seen[name] = _between(resampling, both[name][..., read.samples], read.known, workers)
        passed[name] = Passed(resampling, workers)
    recorded = [*_recorded("hold", held, period), *_recorded("lie", drawn, period)]
    chosen = {"torque_readings": True} if of_torque and "torque" in held else {}
    return Unheld(
        seen, passed, "; ".join(one.words for one in recorded), "; ".join(one.doubt for one in recorded), chosen
    )


def _of_both(of_row: Callable[[npt.NDArray[np.number]], Read | None], both: _Channels) -> dict[str, Read]:
    """Return readings of the channels that have some."""
    found = {name: _of_all(of_row, values) for name, values in both.items()}
    return {name: one for name, one in found.items() if one is not None}


def _are_alike(read: Mapping[str, Read]) -> bool:
    """Return whether both channels were read at the same samples."""
    return len(read) > 1 and np.array_equal(read["angle"].samples, read["torque"].samples)


@dataclass(frozen=True)
class _Repeated:
    """What a recorder did to channels, in words.

    Parameters
    ----------
    what : str
    between : ndarray
        Samples from reading to reading.
    rate : float
        Readings in a second.
    """

    what: str
    between: Numbers
    rate: float

    @property
    def words(self) -> str:
        """What was done."""
        return f"{self.what}, as where it was read at {self.rate:.4g} Hz: splines of order {_ORDER} go from reading to reading"

    @property
    def doubt(self) -> str:
        """What to do."""
        hold = _usual(self.between)
        is_even = hold == round(hold) and float(np.ptp(self.between)) == 0
        own = "give it times of its own, t=(…, …)"
        cure = f"{own}, or keep every {ordinal(hold)} sample of both channels" if is_even else f"or {own}"
        return (
            f"{self.what}: splines between readings were taken instead; better record what is read as it comes, {cure}"
        )


def _recorded(verb: str, read: Mapping[str, Read], period: float) -> list[_Repeated]:
    """Return what a recorder did: held values, or drew lines."""
    if not read:
        return []
    between = np.diff(next(iter(read.values())).places)
    hold = _usual(between)
    names, ending = ("both channels", "") if len(read) > 1 else (f"the {next(iter(read))}", "s")
    if verb == "hold":
        what = f"{names} hold{ending} every value for {hold:.3g} samples"
    else:
        what = f"{names} lie{ending} on straight lines between every {ordinal(hold)} sample"
    return [_Repeated(what, between, 1 / (period * hold))]


def holds_that_stay(angles: npt.NDArray[np.number]) -> list[tuple[int, str]]:
    """Return what to do about angles that hold their readings, by record, where nothing replaced what they hold."""
    found = ((record, readings_of(row)) for record, row in enumerate(angles.reshape(-1, angles.shape[-1])))
    holds = {record: _usual(np.diff(one.places)) for record, one in found if one is not None}
    what = "which makes it late by half of that, and its steps are no motion"
    cure = "use method='auto', which takes its readings and splines between them, or give it times of its own, t=(…, …)"
    return [
        (record, f"the angle holds every value for {hold:.3g} samples, {what}: {cure}")
        for record, hold in holds.items()
    ]


def _usual(between: Numbers) -> float:
    """Return the mean of the usual steps from reading to reading."""
    median = float(np.median(between))
    return float(between[np.abs(between - median) < _JITTER * median].mean())


def _between(
    resampling: _core.Resampling, readings: npt.NDArray[np.number], known: npt.NDArray[np.bool_], workers: int | None
) -> Numbers:
    """Return a channel at every sample, from its readings and whether they are known."""
    rows = np.array(readings.reshape(-1, readings.shape[-1]), dtype=np.float64)
    rows[~(np.isfinite(rows) & known)] = np.nan
    found = resampling.onto_grid(rows, workers=workers)
    return found.reshape(*readings.shape[:-1], found.shape[-1])


def _of_all(of_row: Callable[[npt.NDArray[np.number]], Read | None], channel: npt.NDArray[np.number]) -> Read | None:
    """Return readings of a channel, where those of all records are at the same samples; None elsewhere."""
    found: list[Read] = []
    for row in channel.reshape(-1, channel.shape[-1]):
        read = of_row(row)
        if read is None or (found and not np.array_equal(read.samples, found[0].samples)):
            return None
        found.append(read)
    return found[0]._replace(known=np.stack([read.known for read in found])) if found else None
