"""Arrays of Zarr, alone or in groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tvident._formats.columns import channels_of, rate_in
from tvident._formats.told import Remark, cut, in_words


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every array of numbers, called by its path with dots, with the unit of its attributes."""
    import numpy as np  # noqa: PLC0415 - within the limits
    import zarr  # noqa: PLC0415 - an extra

    opened: Any = zarr.open(path, mode="r")
    alone = isinstance(opened, zarr.Array)
    found = {"": (opened, [dict(opened.attrs)])} if alone else dict(_arrays(opened, "", []))
    rate = rate_in(dict(opened.attrs), [one for _, each in found.values() for one in each], skipped)
    if rate is not None:
        yield "sample_rate [Hz]", np.float64(rate)
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


def _arrays(
    group: Any, prefix: str, above: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, tuple[Any, list[Mapping[str, Any]]]]]:
    """Give all arrays, with their attributes and those of the groups that they are in."""
    around = [dict(group.attrs), *above]
    for name, array in sorted(group.arrays()):
        yield prefix + name, (array, [dict(array.attrs), *around])
    for name, inner in sorted(group.groups()):
        yield from _arrays(inner, f"{prefix}{name}.", around)
