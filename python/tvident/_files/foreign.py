"""Files of other programs: read in a process of its own by the library that knows them."""

from __future__ import annotations

import io
import json
import os
import sys
import threading
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

import numpy as np

from tvident._files.arrays import fill, numeric
from tvident._files.channels import Channels, FileError, Say
from tvident._files.names import listed, printable
from tvident._files.text import read_columns
from tvident._formats import FORMATS, PROCESS
from tvident._units import named_unit, unit_of, with_unit

_BYTES, _BYTES_FOR_EACH = 2 << 30, 64
"""Memory of the reader: what its libraries take, and compressed content."""

_SECONDS, _BYTES_A_SECOND = 30, 2_000_000
"""Time of the reader: the start of Python on a busy machine, and slow disks."""

_LONGEST_LINE = 1 << 20


def read_foreign(path: Path, say: Say) -> Channels:
    """Read a file of another program.

    A damaged file can crash the library that reads it or keep it busy for ever, so it works in a process of its own, with a limit of time
    and memory.
    """
    import subprocess  # noqa: PLC0415 - few need it, and it takes long to import

    kind = FORMATS[path.suffix.lower()]
    if find_spec(kind.package) is None:
        raise FileError(f"{kind.name} needs {kind.package}; install it with: pip install 'tvident[{kind.extra}]'")
    files = sorted(one for one in path.rglob("*") if one.is_file()) if path.is_dir() else [path]
    for one in files:
        with one.open("rb"):
            pass  # what may not be read says so in the same words as any other file
    size = sum(one.stat().st_size for one in files)
    if not size:
        raise FileError(f"{kind.name} must not be empty; this one has no bytes; {kind.cure}")
    seconds = kind.slowness * (_SECONDS + size // _BYTES_A_SECOND)
    limits = (str(_BYTES + _BYTES_FOR_EACH * size), str(seconds))
    # -P: the folder of the reader is no place to import from; the rest is found where this process finds it.
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONWARNINGS": "ignore",
    }
    process = subprocess.Popen(  # noqa: S603 - Python itself
        [sys.executable, "-P", str(PROCESS), kind.module, str(path.absolute()), *limits],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    late = threading.Timer(seconds, process.kill)
    late.daemon = True
    late.start()
    last: dict[str, Any] = {}
    try:
        assert process.stdout is not None  # noqa: S101 - a pipe was asked for
        texts: list[str] = []
        channels = numeric(_arrays(process.stdout, last, texts), say)
        process.wait()
    finally:
        is_late = not late.is_alive()
        late.cancel()
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
    if not last:
        ended = f"took more than {seconds} s" if is_late else f"ended with status {process.returncode}"
        raise FileError(f"{kind.name} must be whole; its reader {ended}; copy it again, or {kind.cure}")
    if last["error"]:
        raise FileError(
            f"{kind.name} must be whole; its reader says: {printable(last['error'], 300).rstrip('.')}; {kind.cure}"
        )
    if last["skipped"]:
        say(f"not read: {listed(last['skipped'])}")
    for remark in last["remarks"]:
        say(printable(remark, 300))
    channels = _with_one_unit(channels, say)
    for text in texts:
        channels |= read_columns(io.StringIO(text), say)
    return channels


def _with_one_unit(channels: Channels, say: Say) -> Channels:
    """Return channels whose names say a unit once, where they say one and the file another time: ``a [deg] [deg]``."""
    found: Channels = {}
    for name, values in channels.items():
        inner, unit = named_unit(name)
        bare, said = named_unit(inner)
        single = with_unit(bare, unit)
        if said and bare and inner.endswith(("]", ")")) and unit_of(said) is not None:
            if unit_of(said) != unit_of(unit):
                said, taken = printable(said, 20), printable(unit, 20)
                say(f"channel '{printable(name, 60)}': its name says '{said}', and the file '{taken}', which is taken")
            elif single not in channels and single not in found:
                found[single] = values
                continue
        found[name] = values
    return found


def _arrays(pipe: IO[bytes], last: dict[str, Any], texts: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the arrays that the reader sends, and keep its last words."""
    while line := pipe.readline(_LONGEST_LINE):
        try:
            head = json.loads(line)
        except ValueError:
            return  # it ended within a line
        if "error" in head:
            last.update(head)
            return
        if "text" in head:
            text = np.empty(head["text"], np.uint8)
            if not fill(text, pipe):
                return
            texts.append(text.tobytes().decode())
            continue
        array = np.empty(head["shape"], head["type"])
        if not fill(array, pipe):
            return
        yield head["name"], array
