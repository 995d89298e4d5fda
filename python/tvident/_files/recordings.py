"""Recordings in files of every kind that can be read: which reader takes which."""

from __future__ import annotations

import stat
import warnings
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import cast

from tvident import _arguments as arguments
from tvident._files.beginnings import cure_of_name
from tvident._files.channels import Channels, FileError, FileWarning, Say
from tvident._files.clock_columns import with_clocks_in_columns
from tvident._files.counts import said_of_counts
from tvident._files.names import printable
from tvident._files.no_values import marks_given, said_of_marks, without_marks
from tvident._files.serial_days import with_days
from tvident._files.split_clock import with_whole_clocks
from tvident._files.unpacked import ending_of
from tvident._formats import FOLDERS, FORMATS

PLAIN = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log")
TEXT, NUMPY = (*PLAIN, ".lvm", ".mot", ".sto"), (".npy", ".npz")
PACKED = tuple(f"{ending}.gz" for ending in PLAIN)
TEXT_ENDINGS = (*PLAIN, *PACKED)
"""Of text in columns."""
JSON = (".jsonl", ".ndjson", ".json")
ARROW = (".parquet", ".feather", ".arrow")
"""Endings of files that can be read."""


RECIPE = "numpy.savez('x.npz', angle=…, torque=…, sample_rate=…)"
"""What anybody can do about a file that nobody reads."""

_READERS = dict.fromkeys((*TEXT, *PACKED), "forms.read_any_text") | {
    ".npy": "arrays.read_npy",
    ".npz": "arrays.read_npz",
    ".lvm": "instrument_text.read_labview",
    ".mot": "instrument_text.read_opensim",
    ".sto": "instrument_text.read_opensim",
    **dict.fromkeys(JSON, "json_text.read_json"),
    **dict.fromkeys(FORMATS, "foreign.read_foreign"),
    **dict.fromkeys(ARROW, "arrow.read_arrow"),
}
"""Files of this room and their functions: imported when they are needed, since few of them ever are."""


def _reader(path: Path) -> Callable[[Path, Say], Channels]:
    module, _, function = _READERS[ending_of(path).lower()].partition(".")
    return cast("Callable[[Path, Say], Channels]", getattr(import_module(f"tvident._files.{module}"), function))


def check_readable(path: Path, endings: Iterable[str]) -> None:
    """Refuse what is no file, before anything waits for it."""
    place = printable(path)
    try:
        kind = path.stat().st_mode
    except FileNotFoundError:
        kind = None
    except PermissionError:
        raise FileError(f"{place}: may not be read; check its permissions") from None
    except (OSError, ValueError) as error:
        raise FileError(f"{place}: is no name of a file ({error.args[-1]}); check it") from None
    ending = ending_of(path)
    is_folder = kind is not None and stat.S_ISDIR(kind)
    if is_folder and not (ending.lower() in FOLDERS and ending.lower() in endings):
        raise FileError(f"{place}: this is a folder; name a file in it")
    if ending.lower() not in endings:
        known = ", ".join(endings)
        got = f"'{printable(ending)}'" if ending else "none"
        raise FileError(
            f"{place}: the ending must be one of {known}; got {got}; rename the file, or convert it in Python: {RECIPE}"
        )
    if kind is None:
        raise FileError(f"{place}: there is no such file; check the name and the folder")
    if not stat.S_ISREG(kind) and not is_folder:
        raise FileError(f"{place}: must be a file; it is a pipe or a device; save what it gives in a file first")


def read(path: str | Path, *, missing: float | Sequence[float] = ()) -> Channels:
    """Read every numeric channel of a file.

    Parameters
    ----------
    path : str or Path
        A text file of columns, JSON, an NPY or NPZ file, or with an extra: Parquet, HDF5, netCDF, Zarr,
        MATLAB, TDMS, xlsx (``io``), MDF (``mdf``), universal files (``uff``), C3D (``c3d``), XDF (``xdf``), ROS bags and MCAP (``ros``).
    missing : float or sequence of float, optional
        Numbers that mark values that are missing, as -9999: they become NaN. One that is far from all other values of a channel is asked
        for in a warning.

    Returns
    -------
    dict of str to ndarray
        Channels by name, in the file's order. Columns without a name are called by their number, from 0. Variables of a MATLAB structure
        are called ``structure.field``.

    Raises
    ------
    FileError
        If the file cannot be read as it is meant, or holds no numbers: the message says which line, the rule and the cure.

    Warns
    -----
    FileWarning
        If something in the file is not read, or not as it stands there: words below the numbers, a name that occurs twice, complex
        channels.

    Notes
    -----
    Channels are arrays of shape (n,), or single numbers; each column of a matrix is a channel. Units are not converted: they are part of
    the name where the file has them there. Text costs some 0.2 µs a number, NPY and NPZ next to nothing, files of other programs half a
    second for a process of their own, since a damaged one can crash its reader.

    In text the line above the numbers names every column; a line of units may stand beside it. Numbers may be in quotes. A comma is a
    decimal sign where semicolons, tabs or blanks separate cells, or numbers are in quotes. Thousands may be separated (``1,234.5``,
    ``1 234``); where a sign may be either, the other numbers of the file decide, or it is refused. Times (``12:30:00.5``,
    ``2024-12-31T12:30:00``) become seconds: of the day, or since the first where there are dates. Columns of words are not read, which is
    said.
    An empty cell, ``nan``, ``NA`` or ``null`` is a missing value; so are errors of spreadsheets (``#DIV/0!``) and words of
    instruments (``OVLD``, ``overflow``, ``No Data``), which is said. ``1.0D+03`` is a number of Fortran. Comments begin with #, behind
    numbers and between rows also with % or //. Text that
    gzip packed (``.csv.gz``) is read as what it holds. Files of LabVIEW (``.lvm``) and OpenSim (``.mot``, ``.sto``) have the units of
    their headers.

    See Also
    --------
    channel : a channel by its name.

    References
    ----------
    Y. Shafranovich: Common format and MIME type for comma-separated values (CSV) files, RFC 4180, 2005.
    NumPy: NEP 1, A simple file format for NumPy arrays: NPY and NPZ.
    Apache Parquet and Apache Arrow: their format specifications. The HDF Group: HDF5 File Format Specification. MathWorks: MAT-File Format.
    ECMA-376: Office Open XML File Formats, for xlsx. ASAM MDF. The others are read by libraries, which the extras in docs/files.md install.

    Examples
    --------
    >>> import tvident
    >>> from tvident import recordings
    >>> tvident.simulate_torsional_rig(duration=1.0).save("rig.npz")
    >>> list(recordings.read("rig.npz"))[:3]
    ['time [s]', 'angle [rad]', 'torque [N m]']
    """
    path = arguments.path_of("path", path)
    marks = marks_given(missing)
    place = printable(path)
    check_readable(path, _READERS)
    said: list[str] = []
    try:
        channels = _reader(path)(path, said.append)
    except FileError as error:
        ending = ending_of(path)
        kind = FORMATS[ending.lower()].name if ending.lower() in FORMATS else ending
        raise FileError(f"{place}: cannot be read as {kind}: {error}{cure_of_name(path, ending, str(error))}") from None
    except PermissionError:
        raise FileError(f"{place}: may not be read; check its permissions") from None
    except OSError as error:
        raise FileError(f"{place}: cannot be read ({error.strerror or error}); check that it is whole") from None
    channels = {name: without_marks(values, marks) for name, values in channels.items()} if marks else channels
    channels = with_whole_clocks(with_clocks_in_columns(channels, said.append), said.append)
    channels = with_days(channels, said.append)
    said += said_of_marks(channels) + list(said_of_counts(channels))
    for message in said:
        warnings.warn(f"{place}: {message}", FileWarning, stacklevel=2)
    if not channels:
        cure = cure_of_name(path, ending_of(path), "")
        raise FileError(f"{place}: holds no numbers; export the channels as columns of numbers, or as arrays{cure}")
    return channels
