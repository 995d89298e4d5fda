"""Stamps that come in packets: whether the samples do, too, or only the stamps, as where a buffer is emptied now and then."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tvident._clocks.few_lines import left_by_lines
from tvident._clocks.grid import Grid, Numbers

_PAUSE = 1.5
"""A step is a pause between packets where it is longer than so many usual ones."""

_FEWEST, _SAMPLES, _MOST = 8, 3, 1 << 10
"""Packets that tell something, at least, samples of one that tell how it goes on within it, and pauses that are looked at."""

_BESIDE = (8, 32, 128)
"""Samples on either side of a pause that are looked at: few follow a fast motion, and many tell of a slow one beside noise."""

_ROWS = 4
"""Records of a batch that are looked at: they have the same stamps."""

_PAUSES = 0.25
"""Part of the time that pauses take at least: where they take less, some samples were lost."""

_SURE = 4.0
"""Standard errors between what samples that were taken evenly would show, or those that were not, and the middle of both."""

_EXPLAINED = 0.2
"""What few lines may leave of a channel to tell anything."""

_BRIEF = 8.0
"""Usual steps up to which a pause is short beside the motion."""

_FAR_MORE, _MORE, _LITTLE = 8.0, 3.0, 0.01
"""How many times as much lines leave by time if its samples are even; less where that is more by such a part of the channel."""

_RARE, _SHARE = 1.5, 0.99
"""Pauses so many times as long as all but a hundredth are gaps of the record."""


def evened_packets(grid: Grid, channels: Mapping[str, npt.NDArray[np.number]]) -> tuple[Grid, str] | None:
    """Return a grid on which pauses between packets are no gaps, and a channel that says so; None where samples are at their times.

    A channel goes on from one packet to the next by as much as it does within them: by sample number, or by time. A motion of few
    frequencies may do both, as where it is periodic and rests are whole periods: then stamps hold.
    """
    found = _packets(grid)
    if found is None:
        return None
    borders, pauses = found
    said = {name: _are_even(grid.places, borders, values) for name, values in channels.items()}
    if not any(said.values()) or any(one is False for one in said.values()):
        return None
    is_long = float(np.median(pauses)) > _BRIEF
    if is_long and not all(_leaves_more_by_time(grid.places, channels[name]) for name, one in said.items() if one):
        return None
    longest = _RARE * float(np.quantile(pauses, _SHARE, method="lower"))
    packets = borders[1:-1]
    return replace(grid, longest=max(grid.longest, longest), packets=packets), next(
        name for name, one in said.items() if one
    )


def _packets(grid: Grid) -> tuple[npt.NDArray[np.intp], Numbers] | None:
    """Return where packets of samples begin and end, and the pauses between them; None where there are none."""
    steps = np.diff(grid.places)
    if steps.size < _FEWEST:
        return None
    is_pause = steps > _PAUSE * float(np.median(steps))
    pauses = steps[is_pause]
    if pauses.size < _FEWEST or float(pauses.sum()) < _PAUSES * float(grid.places[-1]):
        return None
    borders = np.concatenate([[0], np.flatnonzero(is_pause) + 1, [grid.places.size]])
    counts = np.diff(borders)
    # Where most samples are alone steps are those of a clock that jitters.
    return None if int(counts[counts >= _SAMPLES].sum()) < grid.places.size / 2 else (borders, pauses)


def _are_even(places: Numbers, borders: npt.NDArray[np.intp], values: npt.NDArray[np.number]) -> bool | None:
    """Tell whether a channel was sampled evenly, whatever its stamps say; None where that is not known."""
    rows = values.reshape(-1, values.shape[-1])[:_ROWS]
    told = [one for row in rows if (one := _is_even(places, borders, row.astype(np.float64))) is not None]
    return None if not told else all(told)


def _leaves_more_by_time(places: Numbers, values: npt.NDArray[np.number]) -> bool:
    """Return whether few lines leave far more of a channel by time than by sample number, or explain it by neither."""
    row = values.reshape(-1, values.shape[-1])[0].astype(np.float64)
    by_number = left_by_lines(np.arange(row.size, dtype=np.float64), row)
    by_time = left_by_lines(places / float(np.median(np.diff(places))), row)
    if min(by_number, by_time) > _EXPLAINED:
        return True
    return bool(by_time > min(_FAR_MORE * by_number, _MORE * by_number + _LITTLE))


def _is_even(places: Numbers, borders: npt.NDArray[np.intp], row: Numbers) -> bool | None:
    for beside in _BESIDE:
        told = _by_samples_beside(places, borders[: _MOST + 2], row, beside)
        if told is not None:
            return told
    return None


def _by_samples_beside(places: Numbers, borders: npt.NDArray[np.intp], row: Numbers, beside: int) -> bool | None:
    """Compare how far a channel goes on across pauses with how far it would by sample number, from so many samples on either side."""
    changes, by_number, ratios = [], [], []
    for first, pause, end in zip(borders[:-2], borders[1:-1], borders[2:], strict=True):
        sides = [slice(max(first, pause - beside), pause), slice(pause, min(end, pause + beside))]
        counts = [one.stop - one.start for one in sides]
        if min(counts) < _SAMPLES:
            continue
        (before, slope_before), (after, slope_after) = (_line(row[one]) for one in sides)
        (from_time, spacing_before), (to_time, spacing_after) = (_line(places[one]) for one in sides)
        apart = sum(counts) / 2
        changes.append(after - before)
        by_number.append((slope_before + slope_after) / 2 * apart)
        ratios.append(apart * (spacing_before + spacing_after) / 2 / (to_time - from_time))
    found = np.array([changes, by_number, ratios])
    found = found[:, np.isfinite(found).all(axis=0)]
    energy = float(found[0] @ found[0])
    if found.shape[1] < _FEWEST or not energy > 0:
        return None
    share = float(found[0] @ found[1]) / energy
    error = math.sqrt(float((found[1] - share * found[0]) ** 2 @ found[0] ** 2)) / energy
    middle = (1 + float(np.median(found[2]))) / 2
    return None if abs(share - middle) < _SURE * error else share > middle


def _line(values: Numbers) -> tuple[float, float]:
    """Return the mean of some values and their slope by number."""
    at = np.arange(values.size) - (values.size - 1) / 2
    return float(values.mean()), float(at @ values) / float(at @ at)
