"""Arrays of Zarr, alone or in groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tvident._formats.columns import channels_of, rate_channel
from tvident._formats.told import Remark, cut, in_words

_Found = dict[str, tuple[Any, list[Mapping[str, Any]]]]


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every array of numbers, called by its path with dots, with the unit of its attributes."""
    import numpy as np  # noqa: PLC0415 - within the limits
    import zarr  # noqa: PLC0415 - an extra

    opened: Any = zarr.open(path, mode="r")
    found = zarr_found(opened)
    yield from _rate(opened, found, skipped)
    for name, (array, attributes) in found.items():
        if np.dtype(array.dtype).kind not in "biufc" and not np.dtype(array.dtype).names:
            skipped.append(f"{cut(name or '0')} (no numbers)")
            continue
        try:
            values = np.asarray(array[...])
        except Exception as error:  # noqa: BLE001 - of one array; the others may be whole
            skipped.append(f"{cut(name or '0')} ({in_words(error)})")
            continue
        lacking = array.nchunks - array.nchunks_initialized
        if lacking:
            filled = f"{lacking} of {array.nchunks} chunks are not in the store and were read as {array.fill_value}"
            skipped.append(
                Remark(f"{cut(name or '0')}: {filled}, as Zarr means it; where they were lost, copy it again")
            )
        yield from channels_of(name or "0", values, attributes)


def zarr_rate(opened: Any, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the sample rate in the attributes of an array or group that is open, or else of the arrays and groups inside."""
    yield from _rate(opened, zarr_found(opened), skipped)


def _rate(opened: Any, found: _Found, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    yield from rate_channel(dict(opened.attrs), [one for _, each in found.values() for one in each], skipped)


def zarr_found(opened: Any) -> _Found:
    """Return all arrays by their paths with dots, with their attributes and those of the groups that they are in."""
    import zarr  # noqa: PLC0415 - an extra

    alone = isinstance(opened, zarr.Array)
    return {"": (opened, [dict(opened.attrs)])} if alone else dict(_arrays(opened, "", []))


def _arrays(
    group: Any, prefix: str, above: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, tuple[Any, list[Mapping[str, Any]]]]]:
    """Give all arrays, with their attributes and those of the groups that they are in."""
    around = [dict(group.attrs), *above]
    for name, array in sorted(group.arrays()):
        yield prefix + name, (array, [dict(array.attrs), *around])
    for name, inner in sorted(group.groups()):
        yield from _arrays(inner, f"{prefix}{name}.", around)
