"""Files that take the place of others when they are whole."""

from __future__ import annotations

import errno
import os
import signal
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from tvident._files.places import check_folder, end_of_links, writes_through

_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)


@contextmanager
def replaced(path: Path) -> Iterator[IO[bytes]]:
    """Give a file to write to that takes the place of another when all went well, and vanishes otherwise.

    Links are followed, the mode of a file that is replaced stays. A pipe or a device is not replaced: it gets all bytes at the end.
    """
    check_folder(path)
    with errors_name(path), _at_the_end(path) if writes_through(path) else _beside(end_of_links(path)) as file:
        yield file


@contextmanager
def errors_name(path: Path) -> Iterator[None]:
    """Let errors of the system name a file where they name none: a full disk does not say where."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            error.filename = str(path)
        raise


@contextmanager
def _beside(place: Path) -> Iterator[IO[bytes]]:
    """Give a file of another name in the same folder, which is renamed when it is whole."""
    # Names may be 255 bytes long.
    beginning = os.fsdecode(os.fsencode(place.name)[:100])
    beside = place.with_name(f".{beginning}.{os.urandom(8).hex()}")
    old = _file_there(place)
    # Nobody else may read what replaces a private file, not even for a moment.
    mode = 0o666 if old is None else 0o600
    with _gone_when_terminated(beside):
        try:
            with _opened(beside, mode, place) as file:
                yield file
            if old is not None:
                _take_manners(beside, old)
            beside.replace(place)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise


def put_in_place(whole: Path, path: Path) -> bool:
    """Give a file that is whole the place of another, as :func:`replaced` does; return whether that was done without copying it."""
    check_folder(path)
    place = end_of_links(path)
    # A pipe or a device gets bytes, and so does another disk.
    if writes_through(path) or whole.stat().st_dev != place.parent.stat().st_dev:
        return False
    old = _file_there(place)
    if old is not None:
        _take_manners(whole, old)
    whole.replace(place)
    return True


def _file_there(place: Path) -> os.stat_result | None:
    """Return what is known of a file that is to be replaced; None where there is none."""
    old = place.stat() if place.exists() else None
    if old is not None and not stat.S_ISREG(old.st_mode):
        raise OSError(errno.EINVAL, "only a file can be replaced; give the name of a file", str(place))
    return old


def _opened(beside: Path, mode: int, place: Path) -> IO[bytes]:
    try:
        return os.fdopen(os.open(beside, _NEW, mode), "wb")
    except OSError as error:
        # Nobody knows the name of the file that was to be renamed.
        raise type(error)(error.errno, error.strerror, str(place)) from None


def _take_manners(beside: Path, old: os.stat_result) -> None:
    """Give a file the owner and the mode of the one that it replaces."""
    if hasattr(os, "chown"):
        with suppress(PermissionError):
            os.chown(beside, old.st_uid, old.st_gid)
    beside.chmod(stat.S_IMODE(old.st_mode))


@contextmanager
def _gone_when_terminated(path: Path) -> Iterator[None]:
    """Remove a file if the process is told to end and nobody else listens: nothing else would."""

    def end(number: int, _: Any) -> None:
        path.unlink(missing_ok=True)
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)

    # Only the main thread may set what happens then.
    names = ("SIGTERM", "SIGHUP") if threading.current_thread() is threading.main_thread() else ()
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    unheard = [number for number in numbers if signal.getsignal(number) == signal.SIG_DFL]
    for number in unheard:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in unheard:
            signal.signal(number, signal.SIG_DFL)


@contextmanager
def _at_the_end(path: Path) -> Iterator[IO[bytes]]:
    """Give a file without a name whose content goes to a pipe or a device when it is whole."""
    import shutil  # noqa: PLC0415 - the library loads without
    import tempfile  # noqa: PLC0415 - likewise

    with os.fdopen(_descriptor(path), "wb") as end, tempfile.TemporaryFile() as file:
        yield file
        file.seek(0)
        shutil.copyfileobj(file, end)


def _descriptor(path: Path) -> int:
    """Open a pipe or a device; a stream of this process goes on where it is."""
    kind = path.stat()
    for stream in (1, 2):
        with suppress(OSError):  # it may be closed
            if os.path.samestat(kind, os.fstat(stream)):
                return os.dup(stream)
    # Without O_NONBLOCK a pipe that has no reader would be waited for.
    flags = os.O_WRONLY | os.O_NONBLOCK | (os.O_TRUNC if stat.S_ISREG(kind.st_mode) else 0)
    try:
        descriptor = os.open(path, flags)
    except OSError as error:
        if error.errno != errno.ENXIO:
            raise
        raise OSError(errno.ENXIO, "nobody reads this pipe; start its reader first", str(path)) from None
    os.set_blocking(descriptor, True)
    return descriptor
