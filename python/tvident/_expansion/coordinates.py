"""What expansions are functions of, scaled to the interval from 0 to 1: time or recorded channels, with their rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import Coordinate
from tvident._expansion.expansion import Expansion
from tvident._expansion.rows import Places
from tvident._expansion.search import RecordPart, rates_of

Array: TypeAlias = npt.NDArray[np.float64]

Rates: TypeAlias = Callable[[Array], tuple[Array, Array]]
"""Gives the first and the second derivative of a channel by time; NaN where it is missing."""


def part_of(name: str, places: Places, expansion: Expansion, time: tuple[Array, float], rates: Rates) -> RecordPart:
    """Return an expanded unknown before it has a size.

    Parameters
    ----------
    name : str
    places : Places
        Where it appears.
    expansion : Expansion
    time : (ndarray, float)
        Seconds, shape (n,), or what else grows evenly, as a phase does, and by how much in a second.
    rates : callable
        Only asked of channels whose rates rows need.

    Raises
    ------
    ValueError
        If a channel stays where it is, or leaves its limits.
    """
    coordinates = _coordinates_of(name, expansion, time, rates if rates_of(places) else None)
    families = expansion.families_within([one.limits for one in coordinates])
    return RecordPart(
        name,
        places,
        coordinates,
        families,
        expansion.given_sizes,
        expansion.largest,
        is_of_time=expansion.is_of_time,
    )


def _coordinates_of(
    name: str, expansion: Expansion, time: tuple[Array, float], rates: Rates | None
) -> list[Coordinate]:
    """Return what an expansion is a function of, scaled, with its rates where the equation needs them."""
    found = []
    each: Sequence[Array] = expansion.channels or [time[0]]
    for channel, given in zip(each, expansion.given_limits, strict=True):
        there = np.isfinite(channel)
        low, high = given or (float(channel[there].min()), float(channel[there].max())) if there.any() else (0, 0)
        if not low < high:
            raise ValueError(
                f"the channel of an Expansion must change; {name} got one that stays at {low:g}; say {name}='constant'"
            )
        outside = there & ((channel < low) | (channel > high))
        if outside.any():
            raise ValueError(
                f"limits must hold every value of the channel; got {low:g} to {high:g} for {channel[there].min():g} "
                f"to {channel[there].max():g}; widen them"
            )
        places = np.where(there, (channel - low) / (high - low), 0.0)
        along = np.broadcast_to(np.zeros((2, 1)), (2, channel.size))
        if expansion.is_of_time:
            along = np.broadcast_to(np.array([[time[1] / (high - low)], [0.0]]), (2, channel.size))
        elif rates is not None:
            along = np.nan_to_num(np.stack(rates(np.where(there, channel, np.nan))) / (high - low))
        found.append(Coordinate(places, along, (low, high), expansion.is_of_time))
    return found


def check_expansion(name: str, places: Places, expansion: Expansion, samples: int) -> None:
    """Refuse functions that have not the derivatives that rows need, and channels of another length."""
    # The second derivative of an inertia may jump.
    if min(rates_of(places), 1) and any(family.smooth < 1 for family in expansion.families):
        refuse(f"{name} needs functions with continuous derivatives", expansion.called, "use 'bspline'")
    for channel in expansion.channels:
        if channel.shape != (samples,):
            refuse(
                "the channel of an Expansion must have a value for every sample",
                f"shape {channel.shape} for {samples} samples",
                "resample it",
            )


def refuse_windows(expanded: str, kinds: Mapping[str, object]) -> None:
    """Refuse what is followed in windows beside an expansion, of unknowns by their names."""
    for name, kind in kinds.items():
        if isinstance(kind, str) and kind in {"windowed", "varying"}:
            refuse(
                f"beside an Expansion of {expanded} all others are constant, known or expansions",
                f"{name}={kind!r}",
                f"say {name}='constant', or give an Expansion of time",
            )


def with_channels(expansion: Expansion, change: Callable[[Array], Any]) -> Expansion:
    """Return an expansion of channels that are changed; one of time as it is."""
    channels = tuple(map(change, expansion.channels))
    return replace(expansion, of=channels if len(channels) > 1 else channels[0]) if channels else expansion


def refuse(rule: str, got: str, cure: str) -> NoReturn:
    """Refuse what an expansion cannot stand beside."""
    raise ValueError(f"{rule}; got {got}; {cure}")
