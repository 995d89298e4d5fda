"""Variables of netCDF that are read piece by piece: of version 4 by h5py, of version 3 from where they lie in the file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files import FileError, printable
from tvident._formats import (
    NetcdfMeaning,
    is_netcdf_3,
    netcdf_3_rate,
    netcdf_4_rate,
    netcdf_columns,
    netcdf_meaning,
    numbers_of_netcdf_3,
    numbers_of_netcdf_4,
)
from tvident._in_pieces.file_rows import ColumnOfRows, RowsOfFile, SourceChannel, opened_by_h5py
from tvident._in_pieces.said import SaidOfRate, said_of_rate

Channels = dict[str, tuple[SourceChannel, int]]


@dataclass(frozen=True)
class _AsMeant:
    """A channel as the attributes of its variable scale it, NaN where they say that it is missing."""

    channel: SourceChannel
    meaning: NetcdfMeaning

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        return np.asarray(self.meaning.of(self.channel.read(first, end)))


@dataclass(frozen=True)
class _OfDataset:
    """A vector in a dataset, along one of its axes, at a place on the others."""

    dataset: Any
    axis: int
    place: tuple[int, ...]

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        along = [*self.place[: self.axis], slice(first, end), *self.place[self.axis + 1 :]]
        return np.asarray(self.dataset[tuple(along)])


def channels_in(path: Path) -> tuple[Channels, SaidOfRate, Callable[[], object]]:
    """Return the channels of a file, what it says of its sample rate, and what closes it.

    Raises
    ------
    FileError
        If it is damaged, or of a version that is not read.
    ImportError
        If its library is missing.
    """
    try:
        is_old = is_netcdf_3(str(path))
    except ValueError as error:
        raise FileError(f"{printable(path)}: {error}") from None
    if is_old:
        return *_of_version_3(path), lambda: None
    file = opened_by_h5py(path, "netCDF 4")
    try:
        return *_of_version_4(file), file.close
    except (OSError, KeyError, RuntimeError) as error:
        file.close()
        raise FileError(
            f"{printable(path)}: must be whole; h5py says: {printable(error, 200)}; copy it again"
        ) from None
    except BaseException:
        file.close()
        raise


def _of_version_4(file: Any) -> tuple[Channels, SaidOfRate]:
    found: Channels = {}
    single: dict[str, Any] = {}
    for name, dataset, labels in numbers_of_netcdf_4(file, []):
        meaning = netcdf_meaning(dataset.attrs)
        single |= _single(name, dataset, meaning)
        for called, axis, place in _vectors(name, dataset, meaning, labels):
            found[called] = _AsMeant(_OfDataset(dataset, axis, place), meaning), dataset.shape[axis]
    return found, said_of_rate(lambda remarks: netcdf_4_rate(file, remarks), single)


def _single(name: str, array: Any, meaning: NetcdfMeaning) -> dict[str, Any]:
    """Return a single number by its name with its unit; nothing where an array holds more."""
    if array.dtype.kind not in "iuf" or math.prod(array.shape) != 1:
        return {}
    return {netcdf_columns(name, (), meaning, [])[0]: meaning.of(np.array(array[()]))}


def _vectors(
    name: str, array: Any, meaning: NetcdfMeaning, labels: Sequence[Any]
) -> Iterator[tuple[str, int, tuple[int, ...]]]:
    """Give the channels of an array: their names, the axis that they lie along, and their place on the others."""
    shape = tuple(array.shape)
    long = [axis for axis, length in enumerate(shape) if length > 1]
    # Complex numbers are no channel, nor is what has more axes than samples and channels.
    if not shape or 0 in shape or len(long) > 2 or array.dtype.kind not in "iuf":  # noqa: PLR2004 - see above
        return
    names, place = netcdf_columns(name, shape, meaning, labels), [0] * len(shape)
    if len(long) < 2:  # noqa: PLR2004 - a vector
        yield names[0], long[0] if long else 0, tuple(place)
        return
    axis, other = long if shape[long[1]] == len(names) else long[::-1]
    for number, called in enumerate(names):
        place[other] = number
        yield called, axis, tuple(place)


def _of_version_3(path: Path) -> tuple[Channels, SaidOfRate]:
    from scipy.io import netcdf_file  # noqa: PLC0415 - an extra

    try:
        with netcdf_file(path, "r", mmap=True) as file:
            lie = _places(file)
            said = _said_by(file)
    except (TypeError, ValueError, IndexError, KeyError, OverflowError, EOFError) as error:
        raise FileError(
            f"{printable(path)}: must be whole; SciPy says: {printable(error, 200)}; copy it again, or save it with xarray's to_netcdf()"
        ) from None
    found: Channels = {}
    for begin, size in {(one.begin, one.size) for one in lie}:
        together = [one for one in lie if (one.begin, one.size) == (begin, size)]
        row = np.dtype(
            {
                "names": [one.name for one in together],
                "formats": [one.kind for one in together],
                "offsets": [one.offset for one in together],
                "itemsize": size,
            }
        )
        rows = RowsOfFile(path, begin, row)
        found |= {one.name: (_AsMeant(ColumnOfRows(rows, one.name), one.meaning), one.samples) for one in together}
    return {one.name: found[one.name] for one in lie}, said


def _said_by(file: Any) -> SaidOfRate:
    """Return what a mapped file says of its sample rate; nothing of it may be referred to when the map is closed."""
    single: dict[str, Any] = {}
    for name, variable, _ in numbers_of_netcdf_3(file, []):
        single |= _single(name, variable.data, netcdf_meaning(dict(variable._attributes)))  # noqa: SLF001 - as SciPy keeps them
    return said_of_rate(lambda remarks: netcdf_3_rate(file, remarks), single)


@dataclass(frozen=True)
class _Lying:
    """Where a channel lies in a file of version 3: the begin and size of the rows that hold it, and its place in them, in bytes."""

    name: str
    begin: int
    size: int
    offset: int
    kind: np.dtype[Any]
    samples: int
    meaning: NetcdfMeaning


def _places(file: Any) -> list[_Lying]:
    """Return where the channels of a mapped file lie: pages of a map would count as memory, so they are not read from there."""
    first = file._mm_buf.__array_interface__["data"][0]  # noqa: SLF001 - SciPy says nowhere else where numbers lie
    begins = {name: one.data.__array_interface__["data"][0] - first for name, one in file.variables.items()}
    records = min((begins[name] for name, one in file.variables.items() if one.isrec), default=0)
    found = []
    for name, variable, labels in numbers_of_netcdf_3(file, []):
        data, meaning = variable.data, netcdf_meaning(dict(variable._attributes))  # noqa: SLF001 - as SciPy keeps them
        for called, axis, place in _vectors(name, data, meaning, labels):
            size = data.strides[axis]
            lies = begins[name] + sum(one * stride for one, stride in zip(place, data.strides, strict=True))
            # Records hold a sample of every variable that grows, rows of a matrix one of every column; a vector within a record lies alone.
            begin = begins[name] + (place[0] * data.strides[0] if axis else 0)
            begin = records if variable.isrec and not axis else begin
            at = lies - begin
            found.append(_Lying(called, begin + at - at % size, size, at % size, data.dtype, data.shape[axis], meaning))
    return found
