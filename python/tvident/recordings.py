"""Recordings in files: CSV and other text, NPY, NPZ and MATLAB; channels by name."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Channels = dict[str, npt.NDArray[Any]]

TEXT, NUMPY, MATLAB = (".csv", ".txt", ".tsv", ".dat"), (".npy", ".npz"), (".mat",)
"""Endings of files that can be read."""


class FileError(Exception):
    """A file that cannot be used. The message says why and what to do."""


def read(path: str | Path) -> Channels:
    """Read every numeric channel of a file.

    Parameters
    ----------
    path : str or Path
        A text file of columns, an NPY or NPZ file, or a MATLAB file (with the extra ``io``).

    Returns
    -------
    dict of str to ndarray
        Channels by name, in the file's order. Columns without a name are called by their number, from 0. Variables of a MATLAB structure
        are called ``structure.field``.

    Raises
    ------
    FileError
        If the file cannot be read, or holds no numbers.

    Notes
    -----
    Channels are arrays of shape (n,), or single numbers; each column of a matrix is a channel. Units are not converted: they are part of
    the name where the file has them there. Text costs some 0.4 µs a number, NPY and NPZ next to nothing.

    Examples
    --------
    >>> import tvident
    >>> from tvident import recordings
    >>> tvident.simulate_torsional_rig(duration=1.0).save("rig.npz")
    >>> list(recordings.read("rig.npz"))[:3]
    ['time [s]', 'angle [rad]', 'torque [N m]']
    """
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path}: this is a folder; name a file in it")
    readers = dict.fromkeys(TEXT, _read_text) | {".npy": _read_npy, ".npz": _read_npz, ".mat": _read_matlab}
    if path.suffix.lower() not in readers:
        known = ", ".join((*TEXT, *NUMPY, *MATLAB))
        got = repr(path.suffix) if path.suffix else "none"
        raise FileError(f"{path}: the ending must be one of {known}; got {got}; convert or rename the file")
    try:
        channels = readers[path.suffix.lower()](path)
    except FileNotFoundError:
        raise FileError(f"{path}: there is no such file; check the name and the folder") from None
    except PermissionError:
        raise FileError(f"{path}: may not be read; check its permissions") from None
    except (OSError, ValueError, EOFError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: cannot be read as {path.suffix} ({error}); check that it is whole") from None
    if not channels:
        raise FileError(
            f"{path}: holds no numbers; export the channels as columns of numbers with a point as the decimal sign"
        )
    return channels


def channel(channels: Mapping[str, npt.NDArray[Any]], name: str, source: str) -> npt.NDArray[Any]:
    """Return a channel by its name, without its unit where it has one, or by its number.

    Parameters
    ----------
    channels : mapping of str to ndarray
        What :func:`read` returned.
    name : str
        Name with or without the unit in brackets, or number from 0.
    source : str
        What the file is called in the message.

    Returns
    -------
    ndarray, shape (n,) or ()
        In the unit of the file.

    Raises
    ------
    KeyError
        If there is no such channel: the message lists what there is.

    Examples
    --------
    >>> import numpy as np
    >>> from tvident import recordings
    >>> channels = {"time [s]": np.arange(3.0), "angle [rad]": np.ones(3)}
    >>> recordings.channel(channels, "angle", "rig.npz")
    array([1., 1., 1.])
    """
    without_units = {re.sub(r"\s*[\[(][^\])]*[\])]\s*$", "", key): key for key in channels}
    for key in (name, without_units.get(name)):
        if key is not None and key in channels:
            return channels[key]
    if name.isdigit() and int(name) < len(channels):
        return list(channels.values())[int(name)]
    raise KeyError(
        f"{source} has no channel {name!r}; it has {', '.join(channels)}; use one of these or a number from 0"
    )


def _read_text(path: Path) -> Channels:
    """Read columns of numbers, with or without names, separated by commas, semicolons, tabs or blanks."""
    encoding = _encoding(path)
    with path.open(encoding=encoding) as file:
        lines = [line for _, line in zip(range(200), file, strict=False)]
    for separator in (",", ";", "\t", None):
        start, width = _first_numbers(lines, separator)
        if width > 1 or (width == 1 and separator is None):
            break
    if not width:
        return {}
    names = _names(lines[:start], separator, width)
    numbers = np.genfromtxt(
        path,
        delimiter=separator,
        skip_header=start,
        encoding=encoding,
        comments="#",
        ndmin=2,
        invalid_raise=True,
    )
    return dict(zip(names, numbers.T, strict=True))


def _encoding(path: Path) -> str:
    """Return how a text is encoded: UTF-8, or else the Western European alphabet of older programs."""
    with path.open(encoding="utf-8-sig") as file:
        try:
            for _ in file:
                pass
        except UnicodeDecodeError:
            return "latin-1"
    return "utf-8-sig"


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip("\"'") for cell in line.strip().rstrip(separator or " ").split(separator)]


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _first_numbers(lines: list[str], separator: str | None) -> tuple[int, int]:
    """Return the first line that holds numbers only, and how many."""
    for index, line in enumerate(lines):
        cells = _cells(line, separator)
        if line.strip() and not line.startswith("#") and any(cells) and all(_is_number(cell) for cell in cells):
            return index, len(cells)
    return 0, 0


def _names(lines: Iterable[str], separator: str | None, width: int) -> list[str]:
    """Return names from the last line above the numbers that has as many, or numbers from 0."""
    names = [str(index) for index in range(width)]
    for line in lines:
        cells = [cell for cell in _cells(line.lstrip("# "), separator) if cell]
        if len(cells) == width == len(set(cells)):
            names = cells
    return names


def _numeric(named: Iterable[tuple[str, Any]]) -> Channels:
    """Return what can be a channel or a number: real arrays, each column of a matrix on its own."""
    channels: Channels = {}
    for name, value in named:
        array = np.asarray(value)
        if array.dtype.names:
            channels |= _numeric((f"{name}.{field}" if name else field, array[field]) for field in array.dtype.names)
            continue
        if array.dtype.kind not in "biuf" or array.size == 0:
            continue
        array = array.squeeze()
        if array.ndim < 2:  # noqa: PLR2004 - a vector or a number
            channels[name or "0"] = array
        elif array.ndim == 2:  # noqa: PLR2004 - a matrix
            columns = array if array.shape[0] >= array.shape[1] else array.T
            prefix = f"{name}." if name else ""
            channels |= {f"{prefix}{index}": column for index, column in enumerate(columns.T)}
    return channels


def _read_npy(path: Path) -> Channels:
    return _numeric([("", np.load(path, allow_pickle=False))])


def _read_npz(path: Path) -> Channels:
    with np.load(path, allow_pickle=False) as archive:
        return _numeric((name, archive[name]) for name in archive.files)


def _read_matlab(path: Path) -> Channels:
    try:
        from pymatreader import read_mat  # noqa: PLC0415 - optional
    except ImportError:
        raise FileError(f"{path}: MATLAB files need pymatreader; install it with: pip install 'tvident[io]'") from None
    with path.open("rb"):
        pass  # a missing file says so in the same words as any other
    try:
        variables = read_mat(str(path))
    except Exception as error:  # noqa: BLE001 - readers of foreign formats raise anything
        raise FileError(f"{path}: cannot be read as a MATLAB file ({error}); save it again with -v7") from None
    return _numeric(_flat("", variables))


def _flat(prefix: str, variables: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """Return the leaves of nested structures with names joined by dots."""
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _flat(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value
