"""Datasets of HDF5 files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from tvident._formats.columns import COLUMNS, UNITS, channels_of, rate_channel
from tvident._formats.told import Remark, cut, in_words


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every dataset of numbers, called by its path with dots, with the unit of its attributes; links are not followed."""
    import h5py  # noqa: PLC0415 - an extra

    with h5py.File(path, "r") as file:
        found = dict(datasets(file, "", h5py))
        yield from hdf5_rate(file, found, skipped)
        for bare, (dataset, attributes) in hdf5_arrays(file, found).items():
            if dataset.shape is None:  # h5py calls this Empty
                skipped.append(f"{cut(bare)} (no samples)")
                continue
            if dataset.dtype.kind not in "biufc" and not dataset.dtype.names:
                skipped.append(f"{cut(bare)} (no numbers)")
                continue
            values = read_whole(bare, dataset, skipped)
            if values is None:
                continue
            skipped += _never_written(cut(bare), dataset)
            yield from channels_of(bare, values, attributes)


def hdf5_arrays(file: Any, found: Mapping[str, Any]) -> dict[str, tuple[Any, list[Mapping[str, Any]]]]:
    """Return datasets by their paths with dots, with attributes: their own, lists beside them, and those of what they are in."""
    lists = dict(_lists(found))
    arrays = {}
    for name, dataset in found.items():
        if name in lists:
            continue
        # A list of the columns may stand beside a matrix, as a dataset of its own.
        beside = {one.rpartition("/")[2]: words for one, words in lists.items() if _is_beside(one, name)}
        arrays[name.replace("/", ".")] = (dataset, [dataset.attrs, beside, dataset.parent.attrs, file.attrs])
    return arrays


def hdf5_rate(file: Any, found: Mapping[str, Any], skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the sample rate in the attributes of a file, or else of its datasets and the groups that they are in."""
    parts = {one.name: one.attrs for dataset in found.values() for one in (dataset, dataset.parent) if one.name != "/"}
    yield from rate_channel(file.attrs, list(parts.values()), skipped)


def _never_written(name: str, dataset: Any) -> Iterator[Remark]:
    """Say of chunks that were never written, where they were read as numbers."""
    if not dataset.chunks or not dataset.size or dataset.fillvalue != dataset.fillvalue:
        return
    chunks = math.prod(-(-extent // chunk) for extent, chunk in zip(dataset.shape, dataset.chunks, strict=True))
    lacking = chunks - dataset.id.get_num_chunks()
    if lacking:
        yield Remark(f"{name}: {lacking} of {chunks} chunks were never written and were read as {dataset.fillvalue}")


def datasets(group: Any, prefix: str, h5py: Any) -> Iterator[tuple[str, Any]]:
    """Give all datasets in the order in which they were made, where the file keeps it."""
    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.HardLink):
            one = group[name]
            if isinstance(one, h5py.Dataset):
                yield prefix + name, one
            elif isinstance(one, h5py.Group):
                yield from datasets(one, f"{prefix}{name}/", h5py)


def read_whole(name: str, dataset: Any, skipped: list[str]) -> Any:
    """Return what a dataset holds; None where it cannot be read, which is said: the others may be whole."""
    try:
        return dataset[()]
    except Exception as error:  # noqa: BLE001 - whatever a damaged chunk or a filter that is not there raises
        skipped.append(f"{cut(name)} ({in_words(error)})")
        return None


def _lists(found: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Give datasets of words that are called as lists of columns or units are, and stand beside a matrix of as many columns or rows."""
    for name, dataset in found.items():
        bare = name.rpartition("/")[2]
        is_list = dataset.dtype.kind in "OSU" and (COLUMNS.fullmatch(bare.lower()) or bare in UNITS)
        if is_list and any(
            _is_beside(name, other) and dataset.size in one.shape for other, one in found.items() if one.ndim > 1
        ):
            with suppress(Exception):  # what is damaged is no list
                yield name, dataset[()]


def _is_beside(name: str, other: str) -> bool:
    return name.rpartition("/")[0] == other.rpartition("/")[0]
