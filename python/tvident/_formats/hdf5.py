"""Datasets of HDF5 files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.told import cut, in_words

_UNITS = ("unit", "units", "Unit", "Units", "UNITS")
_RATES = ("sample_rate", "sampling_rate", "fs", "Fs", "samplerate", "SampleRate")


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every dataset of numbers, called by its path with dots, with the unit of its attributes; links are not followed."""
    import h5py  # noqa: PLC0415 - an extra
    import numpy as np  # noqa: PLC0415 - within the limits

    with h5py.File(path, "r") as file:
        found = dict(_datasets(file, "", h5py))
        rate = _text_or_number(file.attrs, _RATES)
        if rate is not None:
            yield "sample_rate [Hz]", np.float64(rate)
        for name, dataset in found.items():
            bare = name.replace("/", ".")
            if dataset.dtype.kind not in "biufc" and not dataset.dtype.names:
                skipped.append(f"{cut(bare)} (no numbers)")
                continue
            try:
                values = dataset[()]
            except Exception as error:  # noqa: BLE001 - of one dataset; the others may be whole
                skipped.append(f"{cut(bare)} ({in_words(error)})")
                continue
            unit = _text_or_number(dataset.attrs, _UNITS)
            yield (f"{bare} [{unit}]" if unit else bare), values


def _datasets(group: Any, prefix: str, h5py: Any) -> Iterator[tuple[str, Any]]:
    """Give all datasets in the order in which they were made, where the file keeps it."""
    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.HardLink):
            one = group[name]
            if isinstance(one, h5py.Dataset):
                yield prefix + name, one
            elif isinstance(one, h5py.Group):
                yield from _datasets(one, f"{prefix}{name}/", h5py)


def _text_or_number(attributes: Any, names: tuple[str, ...]) -> Any:
    """Return the first of these attributes that is there, as text or a number."""
    for name in names:
        if name in attributes:
            value = attributes[name]
            value = value.item() if hasattr(value, "item") and value.size == 1 else value
            return value.decode(errors="replace") if isinstance(value, bytes) else value
    return None
