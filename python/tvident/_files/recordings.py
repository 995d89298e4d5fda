"""Recordings in files: CSV and other text, NPY, NPZ and MATLAB."""

from __future__ import annotations

import zipfile
from pathlib import Path

from tvident._files.arrays import read_matlab, read_npy, read_npz
from tvident._files.channels import Channels, FileError
from tvident._files.text import read_text

TEXT, NUMPY, MATLAB = (".csv", ".txt", ".tsv", ".dat"), (".npy", ".npz"), (".mat",)
"""Endings of files that can be read."""


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

    See Also
    --------
    channel : a channel by its name.

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
    readers = dict.fromkeys(TEXT, read_text) | {".npy": read_npy, ".npz": read_npz, ".mat": read_matlab}
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
