"""Blocks of long dask arrays, each with the neighbours that its windows need, and trees of what they say together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from tvident import _arguments as arguments
from tvident._identify import Span


def imported() -> tuple[Any, Any]:
    """Return dask and its arrays.

    Raises
    ------
    ImportError
        If dask is missing.
    """
    try:
        import dask  # noqa: PLC0415 - an extra
        from dask import array  # noqa: PLC0415 - likewise
    except ImportError:
        raise ImportError(
            "tvident.dask needs dask, which is not installed; install it with: pip install 'tvident[dask]'"
        ) from None
    return dask, array


def samples_of(name: str, values: Any, hidden: float = np.nan) -> Any:
    """Return a dask array of real numbers with time along its last axis; masked ones are `hidden`.

    Raises
    ------
    TypeError
        If it is none, or holds no real numbers.
    ValueError
        If it has no axis, no samples, or chunks of unknown size.
    """
    _, array = imported()
    if not isinstance(values, array.Array):
        raise TypeError(f"{name} must be a dask array; got {arguments.shown(values)}; {_cure(name, values)}")
    if values.dtype.kind not in "biuf":
        raise TypeError(f"{name} must hold real numbers; got {values.dtype}; convert it")
    if values.ndim and np.isnan(values.size):
        raise ValueError(
            f"{name} must have chunks of known size; got shape {values.shape}; call {name}.compute_chunk_sizes() before"
        )
    if not values.ndim or not values.size > 0:
        raise ValueError(f"{name} must hold samples along its last axis; got shape {values.shape}; check what was read")
    if isinstance(getattr(values, "_meta", None), np.ma.MaskedArray):
        values = array.ma.filled(values.astype(np.result_type(values.dtype, np.float16)), hidden)
    return values if arguments.is_read_as_it_is(values.dtype) else values.astype(np.float64)


def weights_of(weights: Any, shape: tuple[int, ...]) -> Any:
    """Return weights of samples of some shape."""
    found = samples_of("weights", weights, hidden=0.0)
    if found.shape not in {shape, shape[-1:]}:
        raise ValueError(
            f"weights must have one value for every sample, shape {shape} or {shape[-1:]}; got {found.shape}; check what was read"
        )
    return imported()[1].broadcast_to(found, shape)


def _cure(name: str, values: Any) -> str:
    """Return how something that is no dask array becomes one."""
    _, array = imported()
    if hasattr(values, "to_dask_array"):
        return f"pass {name}.to_dask_array(lengths=True)"
    if isinstance(getattr(values, "data", None), array.Array):
        return f"pass {name}.data"
    return "make one with dask.array.from_array, or call the function of tvident for arrays in memory"


def blocks(chunks: Sequence[int], least: int) -> list[Span]:
    """Return blocks of samples: chunks of an array, together where they are shorter than `least`."""
    borders, length = [0], 0
    for chunk in chunks:
        length += chunk
        if length >= least:
            borders.append(borders[-1] + length)
            length = 0
    if length:
        # The last has no later neighbour to join.
        if len(borders) > 1:
            borders[-1] += length
        else:
            borders.append(length)
    return list(pairwise(borders))


def rows(block: Span, step: int) -> int:
    """Return how many samples of a block have a number that is a multiple of `step`."""
    return len(range(block[0] + -block[0] % step, block[1], step))


def tree(parts: Iterable[Any], merge: Callable[[Any, Any], Any]) -> Any:
    """Return what all parts say together: neighbours first, in the order of the record."""
    level = list(parts)
    while len(level) > 1:
        pairs = [merge(*level[place : place + 2]) for place in range(0, len(level) - 1, 2)]
        level = pairs + level[len(pairs) * 2 :]
    return level[0]


def joined(parts: Sequence[Any], counts: Sequence[int], dtype: Any, leading: tuple[int, ...] = ()) -> Any:
    """Return one array of what was delayed, block by block along the last axis."""
    _, array = imported()
    meta = np.empty((0,) * (len(leading) + 1), dtype)
    each = [
        array.from_delayed(part, shape=(*leading, count), dtype=dtype, meta=meta)
        for part, count in zip(parts, counts, strict=True)
        if count
    ]
    return array.concatenate(each, axis=-1)


def stacked(records: Sequence[Any], batch: tuple[int, ...], lead: int = 0) -> Any:
    """Return one array of those of all records, in the shape of the batch behind `lead` axes."""
    _, array = imported()
    if not batch:
        return records[0]
    together = array.stack(records, axis=lead)
    return together.reshape(*together.shape[:lead], *batch, *together.shape[lead + 1 :])
