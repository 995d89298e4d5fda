"""Recordings in files that are read piece by piece: one channel after the other, any samples."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files import (
    TEXT_ENDINGS,
    FileError,
    ending_of,
    full_name,
    listed,
    names_of_text,
    printable,
    without_marks,
)
from tvident._formats import columns_of, datasets, hdf5_arrays, hdf5_rate, zarr_found, zarr_rate
from tvident._in_pieces.file_rows import ColumnOfRows, RowsOfFile, SourceChannel, opened_by_h5py
from tvident._in_pieces.said import NOTHING_SAID, SaidOfRate, said_of_rate
from tvident._units import named_unit


@dataclass(frozen=True)
class Source:
    """A recording that is not read yet.

    Parameters
    ----------
    channels : mapping of str to (Channel, int)
        Every channel, by its name with its unit in brackets, and how many samples it has.
    close : callable
        Closes the file.
    place : str
        What messages call it.
    said : SaidOfRate
        What it says of its sample rate, and what of that is not read.
    """

    channels: Mapping[str, tuple[SourceChannel, int]]
    close: Callable[[], object]
    place: str
    said: SaidOfRate = NOTHING_SAID

    def channel(self, name: str) -> tuple[SourceChannel, int, str]:
        """Return a channel by its name, how many samples it has, and its unit.

        Raises
        ------
        KeyError
            If there is none of this name, or there are several.
        """
        full = full_name(self.channels, name, self.place)
        channel, samples = self.channels[full]
        return channel, samples, named_unit(full)[1]

    def of_length(self, what: str, name: str, samples: int) -> tuple[SourceChannel, str]:
        """Return a channel beside angle and torque, and its unit.

        Raises
        ------
        ValueError
            If it has not one value for every sample.
        """
        channel, count, unit = self.channel(name)
        if count != samples:
            raise ValueError(
                f"{what} must have one value for every sample; {name!r} has {count} for {samples}; leave it out, or take another channel"
            )
        return channel, unit

    def with_missing(self, marks: Sequence[float]) -> Source:
        """Return the same recording with NaN in place of numbers that mark missing values."""
        if not marks:
            return self
        channels = {name: (_Unmarked(channel, marks), samples) for name, (channel, samples) in self.channels.items()}
        return replace(self, channels=channels)


@dataclass(frozen=True)
class _Unmarked:
    """A channel with NaN in place of numbers that mark missing values."""

    channel: SourceChannel
    marks: Sequence[float]

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        return without_marks(self.channel.read(first, end), self.marks)


@dataclass(frozen=True)
class _OfArray:
    """A vector, or a column or row of a matrix, of anything that is sliced as NumPy's arrays are."""

    array: Any
    place: int | None = None
    is_row: bool = False

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        if self.place is None:
            return np.asarray(self.array[first:end])
        return np.asarray(self.array[self.place, first:end] if self.is_row else self.array[first:end, self.place])


@dataclass(frozen=True)
class _FieldOfArray:
    """A field of a vector of structures."""

    array: Any
    field: str

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        return np.asarray(self.array[first:end][self.field])


def _npy(path: Path) -> Source:
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, is_fortran, dtype = header(file)
        offset = file.tell()
    if dtype.names:
        _check_shape(path, len(shape) == 1, shape)
        fields = RowsOfFile(path, offset, dtype)
        kept = [name for name in dtype.names if dtype[name].kind in "iuf" and not dtype[name].shape]
        return _source(path, {name: (ColumnOfRows(fields, name), shape[0]) for name in kept})
    if dtype.kind not in "iuf":
        raise FileError(f"{printable(path)}: an array must hold real numbers; it holds {dtype}; convert it")
    if len(shape) == 1:
        return _source(path, {"0": (ColumnOfRows(RowsOfFile(path, offset, dtype), 0), shape[0])})
    _check_shape(path, len(shape) == 2, shape)  # noqa: PLR2004 - samples and channels
    rows, columns = shape if shape[0] >= shape[1] else shape[::-1]
    # Samples of a channel lie side by side where the first axis is that of the channels, or the order is Fortran's.
    apart = is_fortran if shape[0] >= shape[1] else not is_fortran
    size = dtype.itemsize * rows
    together = RowsOfFile(path, offset, dtype, columns)

    def column(place: int) -> ColumnOfRows:
        return (
            ColumnOfRows(RowsOfFile(path, offset + place * size, dtype), 0) if apart else ColumnOfRows(together, place)
        )

    return _source(path, {str(place): (column(place), rows) for place in range(columns)})


def _check_shape(path: Path, is_right: bool, shape: tuple[int, ...]) -> None:  # noqa: FBT001 - what is checked
    if not is_right:
        raise FileError(
            f"{printable(path)}: an array must hold one row a sample; its shape is {shape}; save samples along the first axis"
        )


def _parquet(path: Path) -> Source:
    from tvident._in_pieces.row_groups import ParquetColumn, ParquetRows  # noqa: PLC0415 - an extra

    rows = ParquetRows(path)
    names = rows.names()
    return Source(
        {shown: (ParquetColumn(rows, name), rows.samples) for shown, name in names.items()}, rows.close, printable(path)
    )


def _hdf5(path: Path) -> Source:
    file = opened_by_h5py(path, "HDF5")
    import h5py  # noqa: PLC0415 - an extra

    found = dict(datasets(file, "", h5py))
    arrays = hdf5_arrays(file, found)
    said = said_of_rate(lambda remarks: hdf5_rate(file, found, remarks), _single(arrays))
    return replace(_source(path, _of_arrays(arrays), file.close), said=said)


def _netcdf(path: Path) -> Source:
    from tvident._in_pieces.netcdf import channels_in  # noqa: PLC0415 - few need it

    channels, said, close = channels_in(path)
    return replace(_source(path, channels, close), said=said)


def _zarr(path: Path) -> Source:
    try:
        import zarr  # noqa: PLC0415 - an extra
    except ImportError:
        raise ImportError(
            "Zarr needs zarr, which is not installed; install it with: pip install 'tvident[io]'"
        ) from None
    try:
        opened = zarr.open(str(path), mode="r")
    except Exception as error:  # noqa: BLE001 - stores raise what they like
        raise FileError(
            f"{printable(path)}: must be a Zarr group or array; zarr says: {printable(error, 200)}"
        ) from None
    found = {name or "0": one for name, one in zarr_found(opened).items()}
    said = said_of_rate(lambda remarks: zarr_rate(opened, remarks), _single(found))
    return replace(_source(path, _of_arrays(found)), said=said)


_Arrays = Mapping[str, tuple[Any, Sequence[Mapping[str, Any]]]]
"""Arrays by their names, with attributes: their own, then those of what they are in."""


def _of_arrays(found: _Arrays) -> dict[str, tuple[SourceChannel, int]]:
    """Return the channels of arrays with attributes, called as in memory: vectors, columns of matrices, fields of structures."""
    channels: dict[str, tuple[SourceChannel, int]] = {}
    for name, (array, attributes) in found.items():
        if not array.shape:
            continue
        fields = [
            one for one in array.dtype.names or () if array.dtype[one].kind in "iuf" and not array.dtype[one].shape
        ]
        if array.ndim == 1 and fields:
            channels |= {f"{name}.{one}": (_FieldOfArray(array, one), array.shape[0]) for one in fields}
        elif array.dtype.kind in "iuf" and array.ndim == 1:
            channels[columns_of(name, array, attributes)[0]] = (_OfArray(array), array.shape[0])
        elif array.dtype.kind in "iuf" and array.ndim == 2:  # noqa: PLR2004 - samples and channels
            names, count = columns_of(name, array, attributes), min(array.shape)
            if len(names) == 1 < count:
                names = [f"{name}.{place}" for place in range(count)]
            is_row = array.shape[1] != len(names)
            for place, called in enumerate(names):
                channels[called] = (_OfArray(array, place, is_row), max(array.shape))
    return channels


def _single(found: _Arrays) -> dict[str, Any]:
    """Return single numbers by their names with units."""
    return {
        columns_of(name, array, attributes)[0]: np.asarray(array[()])
        for name, (array, attributes) in found.items()
        if array.shape is not None and array.dtype.kind in "iuf" and math.prod(array.shape) == 1
    }


def _source(
    path: Path, channels: Mapping[str, tuple[SourceChannel, int]], close: Callable[[], object] = lambda: None
) -> Source:
    return Source(channels, close, printable(path))


READERS: dict[str, Callable[[Path], Source]] = {
    ".npy": _npy,
    ".parquet": _parquet,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".nc": _netcdf,
    ".nc4": _netcdf,
    ".cdf": _netcdf,
    ".zarr": _zarr,
}
"""By the ending."""


def opened(path: Path) -> Source:
    """Open a recording.

    Raises
    ------
    FileError
        If there is none, it cannot be read piece by piece, or it is damaged.
    ImportError
        If its library is missing.
    """
    place, ending = printable(path), ending_of(path).lower()
    if not path.exists():
        raise FileError(f"{place}: there is no such file; check the name and the folder")
    if ending != ".zarr" and not path.is_file():
        raise FileError(f"{place}: must be a file; it is a folder, a pipe or a device; name the file")
    if ending not in READERS:
        known = ", ".join([*READERS, *TEXT_ENDINGS])
        raise FileError(f"{place}: files that end in {known} are read piece by piece; got '{ending}'; convert it first")
    try:
        source = READERS[ending](path)
    except (FileError, ImportError):
        raise
    except (OSError, ValueError, EOFError) as error:
        raise FileError(f"{place}: must be whole; it cannot be read ({printable(error, 200)}); copy it again") from None
    if not source.channels:
        source.close()
        raise FileError(f"{place}: holds no channels; {listed(['nothing that is a column of real numbers'])}")
    return source


def names_in(path: Path) -> list[str]:
    """Return what the channels of a recording are called, with their units.

    Raises
    ------
    FileError
        If there is none, or it cannot be read piece by piece.
    ImportError
        If its library is missing.
    """
    if ending_of(path).lower() in TEXT_ENDINGS and path.is_file():
        try:
            return names_of_text(path)
        except FileError as error:
            raise FileError(f"{printable(path)}: cannot be read as text: {error}") from None
    source = opened(path)
    source.close()
    return list(source.channels)
