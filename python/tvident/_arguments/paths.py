"""Names of files."""

from __future__ import annotations

import os
from pathlib import Path

from tvident._arguments.shown import shown


def path_of(what: str, value: object) -> Path:
    """Return the path of a file that is to be read or written.

    Raises
    ------
    TypeError
        If it is neither text nor a path.
    ValueError
        If no file can have that name.
    """
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        cure = (
            "write what it holds to a file first"
            if hasattr(value, "read") or isinstance(value, bytes)
            else "write 'rig.csv', say"
        )
        raise TypeError(f"{what} must be the name of a file; got {shown(value)}; {cure}")
    if not os.fspath(value) or "\0" in os.fspath(value):
        raise ValueError(f"{what} must be a name that a file can have; got {shown(value)}; write 'rig.csv', say")
    return Path(value)
