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
    """
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        cure = (
            "write what it holds to a file first"
            if hasattr(value, "read") or isinstance(value, bytes)
            else "write 'rig.csv', say"
        )
        raise TypeError(f"{what} must be the name of a file; got {shown(value)}; {cure}")
    return Path(value)
