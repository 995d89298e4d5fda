"""Arrays in files of NumPy."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from tvident._files.channels import Channels, FileError, Say, check_count
from tvident._files.names import listed, printable

_LARGE, _RATIO = 1 << 28, 200
"""Bytes from which an archive may not unpack to more than so many times its size: recordings do not."""


def numeric(named: Iterable[tuple[str, Any]], say: Say) -> Channels:
    """Return what can be a channel or a number: real arrays, each column of a matrix on its own."""
    skipped: list[str] = []
    empty: list[str] = []
    channels = _numeric(named, skipped, empty)
    if skipped:
        say(f"not read: {listed(skipped)}; channels are real, and vectors or columns of a matrix")
    # What is empty beside channels was to be one; in structures of settings it is nothing.
    recorded = {name.rpartition(".")[0] for name, values in channels.items() if values.size > 1}
    without = [f"'{printable(name or '0', 60)}'" for name in empty if name.rpartition(".")[0] in recorded]
    if without:
        say(f"without samples: {listed(without)}")
    return channels


def _numeric(named: Iterable[tuple[str, Any]], skipped: list[str], empty: list[str]) -> Channels:
    channels: Channels = {}
    for name, value in named:
        array = np.asarray(value)
        if array.dtype.names:
            fields = ((f"{name}.{field}" if name else field, array[field]) for field in array.dtype.names)
            channels |= _numeric(fields, skipped, empty)
            continue
        if array.dtype.kind == "c":
            skipped.append(f"{name or '0'} (complex)")
        if array.dtype.kind not in "biuf":
            continue
        if array.size == 0:
            empty.append(name)
            continue
        if array.dtype.kind == "b":
            array = array.view(np.uint8) != 0  # in a file true may be any byte
        array = array.squeeze()
        if array.ndim < 2:  # noqa: PLR2004 - a vector or a number
            channels[name or "0"] = array
        elif array.ndim == 2:  # noqa: PLR2004 - a matrix
            columns = array if array.shape[0] >= array.shape[1] else array.T
            check_count(len(channels) + columns.shape[1])
            prefix = f"{name}." if name else ""
            channels |= {f"{prefix}{index}": column for index, column in enumerate(columns.T)}
        else:
            skipped.append(f"{name or '0'} ({array.ndim} dimensions)")
        check_count(len(channels))
    return channels


def read_npy(path: Path, say: Say) -> Channels:
    with path.open("rb") as file:
        array = _array(file, path.stat().st_size)
    if array is None:
        raise FileError("an array must hold numbers; this one holds Python objects; save numbers with numpy.save")
    return numeric([("", array)], say)


def read_npz(path: Path, say: Say) -> Channels:
    objects: list[str] = []
    try:
        with zipfile.ZipFile(path) as archive:
            members = [one for one in archive.infolist() if one.filename.endswith(".npy")]
            check_count(len(members))
            _check_unpacked(sum(one.file_size for one in members), path.stat().st_size)
            channels = numeric(_members(archive, members, objects), say)
    except (FileError, MemoryError, OSError):
        raise
    except Exception as error:  # noqa: BLE001 - zipfile and zlib raise many kinds for damaged archives
        raise FileError(
            f"it must be an archive as numpy.savez writes it; {printable(error)}; check that it is whole"
        ) from None
    if objects:
        say(f"not read, since only Python could say what they hold: {listed(objects)}")
    return channels


def _members(
    archive: zipfile.ZipFile, members: Iterable[zipfile.ZipInfo], objects: list[str]
) -> Iterator[tuple[str, Any]]:
    for member in members:
        name = member.filename.removesuffix(".npy")
        with archive.open(member) as file:
            try:
                array = _array(file, member.file_size)
            except FileError as error:
                raise FileError(f"'{printable(name, 60)}' in it: {error}") from None
        if array is None:
            objects.append(name)
        else:
            yield name, array


def _check_unpacked(unpacked: int, size: int) -> None:
    if unpacked > _LARGE and unpacked > _RATIO * size:
        raise FileError(
            f"an archive must unpack to at most {_RATIO} times its size; this one has {size} bytes for {unpacked}; "
            f"save it again with numpy.savez"
        )


def _array(file: IO[bytes], size: int) -> Any:
    """Return the array in a file of that size, or None if it holds Python objects."""
    try:
        shape, is_fortran, dtype = _header(file)
    except (MemoryError, OSError):
        raise
    except Exception as error:  # noqa: BLE001 - the header is parsed as Python, which raises anything
        raise FileError(
            f"it must begin as numpy.save writes it; {printable(error)}; check that it is whole, or save it again"
        ) from None
    if dtype.hasobject:
        return None
    # Memory is asked for only if the file holds what its header promises.
    count, follow = math.prod(shape), size - file.tell()
    if min(shape, default=0) < 0 or count * dtype.itemsize != follow:
        promised = printable(" x ".join(printable(length, 20) for length in shape), 60)
        raise FileError(
            f"the header must say how many bytes follow; it says {promised} of {dtype.itemsize}, and there are {follow}; "
            f"the file was cut or damaged: copy it again"
        )
    array = np.empty(count, dtype)
    if not fill(array, file):
        raise FileError(f"{array.nbytes} bytes of numbers must follow the header; there are fewer; copy it again")
    return array.reshape(shape, order="F" if is_fortran else "C")


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    return read(file)


def fill(array: npt.NDArray[Any], file: IO[bytes]) -> bool:
    """Read an array's bytes, in pieces: an interrupt is heard between. Return whether there are enough."""
    left = array.reshape(-1).view(np.uint8).data if array.nbytes else memoryview(b"")
    while left:
        got = file.readinto(left[: 1 << 24])  # type: ignore[attr-defined]
        if not got:
            return False
        left = left[got:]
    return True
