"""Bytes of text files, those that gzip made smaller as they were."""

from __future__ import annotations

import gzip
import io
import zlib
from pathlib import Path
from typing import IO, Any

from tvident._files.channels import FileError

_LARGE, _RATIO = 1 << 28, 200
"""Bytes from which a file may not unpack to more than so many times its size: recordings do not."""

_GZIP = b"\x1f\x8b"


def ending_of(path: Path) -> str:
    """Return what a file's name ends in: of a packed one with what stands before, as ``.csv.gz``."""
    return "".join(path.suffixes[-2:]) if path.suffix.lower() == ".gz" else path.suffix


def opened(path: Path) -> IO[bytes]:
    """Open a file; one that is called ``.gz``, and packed, is read as what it holds."""
    file = path.open("rb")
    if path.suffix.lower() != ".gz":
        return file
    with file:
        is_packed = file.read(len(_GZIP)) == _GZIP
    return io.BufferedReader(_Unpacked(path)) if is_packed else path.open("rb")


class _Unpacked(io.RawIOBase):
    """What a packed file holds, which may begin again, and ends in words where it is damaged or unpacks to too much."""

    def __init__(self, path: Path) -> None:
        self._file = gzip.open(path, "rb")  # noqa: SIM115 - closed with this
        self._most = max(_LARGE, _RATIO * path.stat().st_size)

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def readinto(self, buffer: Any) -> int:
        try:
            got = self._file.readinto(buffer)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise FileError(f"a packed file must be whole; gzip says: {error}; copy it again") from None
        if self._file.tell() > self._most:
            raise FileError(
                f"a packed file must unpack to at most {_RATIO} times its size, or {_LARGE >> 20} MB; this one has more; unpack it yourself"
            )
        return got

    def close(self) -> None:
        self._file.close()
        super().close()
