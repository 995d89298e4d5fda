"""Where results may be written: never over what was read or what is written beside them."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Mapping
from pathlib import Path

from tvident._files.names import printable
from tvident._files.table_formats import PACKAGES, check_installed

ENDINGS = (".csv", ".npz", *PACKAGES)
"""Kinds of files that tables are written to."""


def check_place(path: Path) -> None:
    """Check that tables can be written to files of this kind, and that a file can be written there."""
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        known = f"{', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}"
        raise ValueError(f"results are written to files that end in {known}; got '{printable(path.name)}'; rename it")
    check_installed(ending)
    check_folder(path)


def check_folder(path: Path) -> None:
    """Check that there is a folder for a file, no folder of its name, and that both may be written to."""
    place = end_of_links(path)
    folder = place.parent if path.is_symlink() else path.parent
    if place.is_dir():
        raise IsADirectoryError(errno.EISDIR, "this is a folder; give the name of a file", str(path))
    if not place.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "there is no such folder; make it first, or write elsewhere", str(folder))
    if writes_through(path):
        kind = path.stat().st_mode
        if stat.S_ISBLK(kind) or stat.S_ISSOCK(kind):
            raise OSError(errno.EINVAL, "this is a disk or a socket; give the name of a file", str(path))
    elif place.exists() and not os.access(place, os.W_OK):
        raise PermissionError(errno.EACCES, "this file may not be changed; write elsewhere", str(path))
    elif not os.access(place.parent, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, "nothing may be written in this folder; write elsewhere", str(folder))


def end_of_links(path: Path) -> Path:
    """Return the file that a path leads to when every link is followed."""
    place = Path(os.path.realpath(path))
    if place.is_symlink():
        raise OSError(errno.ELOOP, "these links lead in a circle; write elsewhere", str(path))
    return place


def writes_through(path: Path) -> bool:
    """Return whether a path is a pipe, a device or a stream of this process: nothing that another file or folder could replace."""
    try:
        kind = path.stat().st_mode
    except OSError:
        return False
    folder = os.path.realpath(path.parent)
    return not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)) or folder == "/dev" or folder.startswith("/proc/")


def check_apart(outputs: Mapping[str, str | Path | None], inputs: Mapping[str, str | Path | None]) -> None:
    """Check that no output is a file that is read, or another output, by whatever name or link.

    Parameters
    ----------
    outputs, inputs : mapping of str to path
        What messages call each file, and its path; None where there is none.

    Raises
    ------
    ValueError
        If two of them are one file, or one lies in the folder that the other is: the message names both.
    """
    written = {name: Path(path) for name, path in outputs.items() if path is not None}
    read = {name: Path(path) for name, path in inputs.items() if path is not None and _exists(Path(path))}
    for index, (name, path) in enumerate(written.items()):
        others = read | dict(list(written.items())[:index])
        for other_name, other in others.items():
            if _lies_in(path, other):
                raise ValueError(
                    f"{name} must not lie in the folder of {other_name}; got '{printable(path)}' in '{printable(other)}'; give another "
                    "place"
                )
            if _are_one(path, other):
                rule = (
                    f"{name} must not replace {other_name}"
                    if other_name in read
                    else f"{name} and {other_name} must be two files"
                )
                raise ValueError(f"{rule}; got '{printable(path)}' for both; give another file")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # the name of a channel may be too long for a file
        return False


def _lies_in(path: Path, folder: Path) -> bool:
    """Return whether a path leads into a folder that is there."""
    inner, outer = Path(os.path.realpath(path)), Path(os.path.realpath(folder))
    return inner != outer and inner.is_relative_to(outer) and _exists(folder) and folder.is_dir()


def _are_one(path: Path, other: Path) -> bool:
    """Return whether two paths lead to the same file, or would once it is written, or the first is a folder that holds the other."""
    if _exists(path) and _exists(other) and path.samefile(other):
        return not writes_through(path)
    ends = Path(os.path.realpath(path)), Path(os.path.realpath(other))
    return ends[0] == ends[1] or (_exists(path) and path.is_dir() and ends[1].is_relative_to(ends[0]))
