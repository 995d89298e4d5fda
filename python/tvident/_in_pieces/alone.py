"""Lets one call at a time work in a folder."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

NAME = "lock"
"""The file in the folder that is locked."""


def alone_in(folder: Path) -> BinaryIO | None:
    """Make a folder, unless it is there, and lock it: until what is returned is closed, or the process ends, however it ends.

    Returns None where the system cannot lock files.

    Raises
    ------
    BlockingIOError
        If another call works there.
    """
    while True:
        folder.mkdir(exist_ok=True)
        with suppress(FileNotFoundError):
            file = (folder / NAME).open("ab")
            try:
                _lock(file)
                # Whoever had the lock may have removed the folder since the file was opened: then nothing of it is locked.
                if os.path.samestat(os.fstat(file.fileno()), (folder / NAME).stat()):
                    return file
            except BlockingIOError:
                file.close()
                raise
            except FileNotFoundError:
                pass
            except OSError:
                file.close()
                return None
            file.close()


def _lock(file: BinaryIO) -> None:
    """Lock an open file, or raise BlockingIOError."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    import msvcrt  # noqa: PLC0415 - there on Windows only

    try:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    except PermissionError as error:
        raise BlockingIOError(*error.args) from None
