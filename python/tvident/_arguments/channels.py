"""Channels: arrays of records whose last axis is time, however they come."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments.arrays import real_array
from tvident._arguments.containers import is_table, time_axis, time_last
from tvident._arguments.labelled import is_called_time
from tvident._arguments.labels import aligned_with
from tvident._units import named_unit

_MOST_NAMES = 6
"""Columns that a message lists."""

_NO_RECORD = 32
"""Samples that no record of a batch is shorter than."""

_NUMBERED = re.compile(r"[tT][ _.-]?\d+")
"""Records of a channel that is called by one letter."""


def channel(name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return a channel with time last: rows of a table and the dimension ``time`` are time, and a column is a record."""
    array = real_array(name, values)
    if time_axis(values) is not None:
        return time_last(values, array)
    return array[..., 0] if array.ndim > 1 and array.shape[-1] == 1 and array.shape[-2] > 1 else array


def channels(**values: npt.ArrayLike) -> list[npt.NDArray[np.number]]:
    """Return channels of one recording, which have one shape.

    Raises
    ------
    ValueError
        If shapes differ, or the first axis seems to be time.
    """
    _check_no_whole_tables(values)
    first = next(iter(values.items()))
    arrays = {name: channel(name, aligned_with(first, (name, value))) for name, value in values.items()}
    shapes = {name: array.shape for name, array in arrays.items()}
    if len(set(shapes.values())) > 1:
        sizes = {array.size for array in arrays.values()}
        if len(sizes) == 1 and all(max(shape) in sizes for shape in shapes.values()):
            # A row beside a column, as MATLAB files have them: one record each.
            return [array.reshape(-1) for array in arrays.values()]
        one, *_, other = shapes.values()
        cure = "transpose one of them" if one == other[::-1] else "cut or reshape one of them"
        if list(shapes) == ["angle", "torque"] and len(one) == len(other) == 1:
            cure += ", or, where their rates differ, give both: sample_rate=(200, 1000), say"
        raise ValueError(f"{' and '.join(shapes)} must have the same shape; got {one} and {other}; {cure}")
    shape = next(iter(shapes.values()))
    if len(shape) > 1 and shape[-1] < _NO_RECORD <= shape[0]:
        raise ValueError(
            f"time must be the last axis; got shape {shape}, records of {shape[-1]} samples: the first axis seems to be time; "
            f"pass {' and '.join(f'{name}.T' for name in arrays)}"
        )
    return list(arrays.values())


def _check_no_whole_tables(values: Mapping[str, Any]) -> None:
    """Refuse a table that was given for several channels, or that holds times: its columns would be records."""
    # What is lazy works for its names, and is refused later.
    there = {name: value for name, value in values.items() if hasattr(value, "to_numpy") and is_table(value)}
    tables = {name: value for name, value in there.items() if len(value.columns) > 1}
    for name, table in tables.items():
        columns = [str(one) for one in table.columns]
        times = _times_among(columns)
        again = [other for other, value in tables.items() if value is table and other != name]
        if not times and not again:
            continue
        which = f"{name} and {again[0]} are one table" if again else f"{name} is a table"
        held = f", of which {times[0]!r} is called as times are" if times else ""
        others = [one for one in columns if one not in times] or columns
        own = next((one for one in others if name in one.casefold()), others[0])
        raise TypeError(
            f"a channel must be one column, or a table with a column for each record; {which} of {', '.join(columns[:_MOST_NAMES])}{held}; "
            f"pass one column for each channel, {name} as table[{own!r}], say"
        )


def _times_among(columns: Sequence[str]) -> list[str]:
    """Return the columns that are called as times are beside others: T1 and T2 alone are torques."""
    bare = {one: named_unit(one)[0] for one in columns}
    times = [one for one, name in bare.items() if is_called_time(name)]
    # Alone these are records. What has another name than a letter with a number is a time beside them.
    return [one for one in times if not _NUMBERED.fullmatch(bare[one])] if len(times) == len(bare) else times


def as_record(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[np.number]:
    """Return numbers to be used beside records of this shape, with time last and a column as the record that it is."""
    array = time_last(values, real_array(name, values))
    return array[..., 0] if array.ndim == len(shape) + 1 and array.shape[-1] == 1 else array
