"""Clocks of channels in files that say by which clock each channel was sampled: one for both would be a lag that nobody hears of."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from tvident import recordings
from tvident._files import ending_of, full_name, printable
from tvident._units import named_unit

_GROUPED = frozenset((".tdms", ".mf4", ".mdf", ".uff", ".unv", ".c3d", ".xdf", ".xdfz", ".mcap", ".db3", ".bag"))
"""Files in which times stand before the channels that were sampled at them."""

_TIME = re.compile(r"time(_[0-9]+)?")

_CLOSE = 1e-2
"""Part of a step that two clocks may differ by and still be one: rounding, and stamps of one driver."""


def check_own_clocks(
    channels: recordings.Channels,
    names: Sequence[str],
    time: str | None,
    torque_time: str | None,
    file: str | None,
    *,
    has_rate: bool,
    takes_both: bool = True,
) -> None:
    """Refuse the clock of one channel for another that has a clock of its own, and say how to give both; warn beside a sample rate."""
    if torque_time is not None or file is None:
        return
    clocks = _clocks_of(channels, names, file)
    if None in clocks or len(clocks) < 2 or _are_one(channels, clocks[0], clocks[-1]):  # noqa: PLR2004 - a motion, a torque
        return
    first, last = (printable(named_unit(str(one))[0]) for one in (clocks[0], clocks[-1]))
    if not takes_both:
        raise click.UsageError(
            f"methods are compared on channels of one clock; {printable(file)} has {first} and {last}; resample one channel at the "
            "times of the other, or leave --methods out"
        )
    cure = f"--time {shlex.quote(first)} --torque-time {shlex.quote(last)}"
    if not has_rate:
        got = "none" if time is None else f"--time {printable(time)} for both"
        raise click.UsageError(
            f"angle and torque must have the times at which each was sampled; {printable(file)} has {first} and {last}, and got {got}; "
            f"give {cure}, or the same for both if they do have one clock"
        )
    where = f"{printable(file)}: angle and torque have clocks of their own, {first} and {last}"
    click.echo(f"Warning: {where}; a sample rate takes their first samples as of one time; give {cure}", err=True)


def check_beside(
    channels: recordings.Channels, motion: str, others: Mapping[str, str | None], file: str | None
) -> None:
    """Refuse channels, by what messages call them, whose samples were taken at other times than those of the motion."""
    if file is None:
        return
    beside = {what: name for what, name in others.items() if name is not None}
    own, *clocks = _clocks_of(channels, [motion, *beside.values()], file) or [None]
    for (what, name), clock in zip(beside.items(), clocks, strict=False):
        if own is not None and clock is not None and not _are_one(channels, own, clock):
            first, other = (printable(named_unit(one)[0]) for one in (own, clock))
            raise click.UsageError(
                f"{what} must have a sample for each of the motion; {printable(file)} has {first} for that and {other} for "
                f"{printable(name)}; resample one channel at the times of the other"
            )


def _clocks_of(channels: recordings.Channels, names: Sequence[str], file: str) -> list[str | None]:
    """Return the times of every channel, as a file of this kind says them; nothing where a channel is of another file."""
    of = _clock_before if ending_of(Path(file)).lower() in _GROUPED else _clock_beside
    try:
        return [of(channels, full_name(channels, name, file)) for name in names]
    except KeyError:
        return []


def _clock_beside(channels: recordings.Channels, name: str) -> str | None:
    """Return the times in a channel's group of the file, where it is in one."""
    prefix = named_unit(name)[0].rpartition(".")[0]
    beside = (one for one in channels if prefix and named_unit(one)[0] == f"{prefix}.time")
    return next((one for one in beside if channels[one].shape == channels[name].shape), None)


def _clock_before(channels: recordings.Channels, name: str) -> str | None:
    """Return the times that a channel was sampled at, by their name in the file; None where it has none."""
    clock = None
    group = named_unit(name)[0]
    for one, values in channels.items():
        prefix, _, bare = named_unit(one)[0].rpartition(".")
        # Channels of one clock have no groups before their names: more times are a channel that was recorded.
        if _TIME.fullmatch(bare) and group.startswith(prefix) and (prefix or clock is None):
            clock = one
        if one == name:
            return clock if clock != one and clock is not None and channels[clock].shape == values.shape else None
    return None


def _are_one(channels: recordings.Channels, clock: Any, other: Any) -> bool:
    first, last = channels[clock], channels[other]
    if clock == other or np.array_equal(first, last):
        return True
    if first.shape != last.shape or first.size < 2:  # noqa: PLR2004 - a step
        return False
    times = [np.asarray(one, float) for one in (first, last)]
    step = abs(times[0][-1] - times[0][0]) / (first.size - 1)
    return bool(np.nanmax(np.abs(times[1] - times[0])) <= _CLOSE * step)
