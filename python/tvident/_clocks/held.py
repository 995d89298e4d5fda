"""Channels that a recorder holds, or draws in lines, from reading to reading: splines go from one to the next instead."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import ordinal
from tvident._clocks.grid import Numbers
from tvident._clocks.missing import Bridged
from tvident._clocks.passed import Passed
from tvident._clocks.readings import Read, knots_of, readings_of

_ORDER = 5
"""Of the splines, as for channels on clocks of their own."""

_GAP = 1.5
"""Readings beyond which a step is a gap."""

_Channels = Mapping[str, npt.NDArray[np.number]]


def unheld(channels: _Channels, period: float, workers: int | None, *, of_torque: bool = False) -> Bridged | None:
    """Return channels without what a recorder made between two readings; None where it made nothing.

    A machine moves between two readings, so what an angle holds there is its recorder's. A torque that is held may be what acts, as that of
    a digital controller, and stays as it is, unless both channels were read at once, or `of_torque` says that it was read. No mass moves
    along straight lines from reading to reading; but what was done to both channels alike changes no equation.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (*, n)
        The angle, the torque or both among them.
    period : float
        Seconds from one sample to the next.
    workers : int, optional
    of_torque : bool
    """
    held = _of_all(readings_of, channels, ("angle", "torque"))
    both = _are_alike(held)
    if not (of_torque or both):
        held.pop("torque", None)
    drawn = _of_all(knots_of, channels, ("angle",))
    if drawn and _are_alike({**drawn, **_of_all(knots_of, channels, ("torque",))}):
        drawn = {}
    read = {**held, **drawn}
    if not read:
        return None
    found, passed = dict(channels), {}
    for name, one in read.items():
        bridged = _GAP * math.ceil(np.median(np.diff(one.places)))
        resampling = _core.Resampling(one.places, channels[name].shape[-1], order=_ORDER, bridged=bridged)
        found[name] = _between(resampling, channels[name][..., one.samples], one.known, workers)
        passed[name] = Passed(resampling, workers)
    seen = {"both channels hold": held["angle"]} if both else {f"the {name} holds": one for name, one in held.items()}
    recorded = [(f"{who} every value for {one.hold:.3g} samples", one) for who, one in seen.items()]
    lines = [
        (f"the {name} lies on straight lines between every {ordinal(one.hold)} sample", one)
        for name, one in drawn.items()
    ]
    recorded += lines
    return Bridged(
        found,
        passed,
        {"torque_readings": True} if of_torque and "torque" in held else {},
        "; ".join(_words(what, one, period) for what, one in recorded),
        [_doubt(what, one) for what, one in recorded],
    )


def _are_alike(read: Mapping[str, Read]) -> bool:
    """Return whether both channels were read at the same samples."""
    return len(read) > 1 and np.array_equal(read["angle"].samples, read["torque"].samples)


def _words(what: str, read: Read, period: float) -> str:
    """Return what was done about what a recorder did."""
    rate = 1 / (period * read.hold)
    return f"{what}, as where it was read at {rate:.4g} Hz: splines of order {_ORDER} go from reading to reading"


def _doubt(what: str, read: Read) -> str:
    """Return what to do about what a recorder did."""
    own = "give it times of its own, t=(…, …)"
    cure = f"{own}, or keep every {ordinal(read.hold)} sample of both channels" if read.is_even else f"or {own}"
    return f"{what}: splines between readings were taken instead; better record what is read as it comes, {cure}"


def holds_that_stay(angles: npt.NDArray[np.number]) -> list[tuple[int, str]]:
    """Return what to do about angles that hold their readings, by record, where nothing replaced what they hold."""
    found = ((record, readings_of(row)) for record, row in enumerate(angles.reshape(-1, angles.shape[-1])))
    holds = {record: one.hold for record, one in found if one is not None}
    what = "which makes it late by half of that, and its steps are no motion"
    cure = "use method='auto', which takes its readings and splines between them, or give it times of its own, t=(…, …)"
    return [
        (record, f"the angle holds every value for {hold:.3g} samples, {what}: {cure}")
        for record, hold in holds.items()
    ]


def _between(
    resampling: _core.Resampling, readings: npt.NDArray[np.number], known: npt.NDArray[np.bool_], workers: int | None
) -> Numbers:
    """Return a channel at every sample, from its readings and whether they are known."""
    rows = np.array(readings.reshape(-1, readings.shape[-1]), dtype=np.float64)
    rows[~(np.isfinite(rows) & known)] = np.nan
    found = resampling.onto_grid(rows, workers=workers)
    return found.reshape(*readings.shape[:-1], found.shape[-1])


def _of_all(
    of_row: Callable[[npt.NDArray[np.number]], Read | None], channels: _Channels, names: Sequence[str]
) -> dict[str, Read]:
    """Return readings of those of some channels that have some, at the same samples of all records."""
    found = {}
    for name in names:
        rows = channels[name].reshape(-1, channels[name].shape[-1]) if name in channels else ()
        read = [of_row(row) for row in rows]
        first = read[0] if read else None
        if first is None:
            continue
        alike = [one for one in read if one is not None and np.array_equal(one.samples, first.samples)]
        if len(alike) == len(read):
            found[name] = first._replace(known=np.stack([one.known for one in alike]))
    return found
