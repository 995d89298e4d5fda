"""Reads the variables of one file in a process of its own, since a damaged file can crash or block its reader.

``_files.foreign`` starts it: ``python process.py FORMAT FILE BYTES SECONDS``. It writes to standard output, for every array of
numbers, a line of JSON with its name, type and shape, then its bytes; at the end a line that says what was not read, and why nothing
was.
"""

from __future__ import annotations

import json
import sys
import warnings
from importlib import import_module
from typing import IO, Any

from tvident._formats.told import Remark, Sheet, cut, in_words


def main(module: str, path: str, most_bytes: str, most_seconds: str) -> None:
    _limit(int(most_bytes), int(most_seconds))
    output = sys.stdout.buffer
    sys.stdout = sys.stderr
    warnings.simplefilter("ignore")  # what cannot be read is said below
    skipped: list[str] = []
    error = ""
    try:
        for name, value in import_module(f"tvident._formats.{module}").variables(path, skipped):
            _give(output, name, value, skipped)
    except BaseException as one:  # noqa: BLE001 - readers of foreign formats raise anything
        error = in_words(one)
    names = [cut(one) for one in skipped if not isinstance(one, Remark)]
    remarks = list(dict.fromkeys(cut(one) for one in skipped if isinstance(one, Remark)))
    _line(output, {"skipped": names, "remarks": remarks, "error": error})


def _limit(most_bytes: int, most_seconds: int) -> None:
    """Let the system end what takes too much, also if nobody is left who waits for it."""
    try:
        import resource  # noqa: PLC0415 - not everywhere
    except ImportError:
        return
    for what, most in (
        (resource.RLIMIT_AS, most_bytes),
        (resource.RLIMIT_CPU, most_seconds),
        (resource.RLIMIT_CORE, 0),
    ):
        soft, hard = resource.getrlimit(what)
        known = [limit for limit in (most, soft, hard) if limit != resource.RLIM_INFINITY]
        resource.setrlimit(what, (min(known), hard))


def _give(output: IO[bytes], name: str, value: Any, skipped: list[str]) -> None:
    import numpy as np  # noqa: PLC0415 - within the limits

    if isinstance(value, Sheet):
        value = value.encode()
        _line(output, {"name": name, "text": len(value)})
        output.write(value)
        return
    try:
        array = np.asarray(value)
    except ValueError:
        skipped.append(f"{cut(name)} (cells of different sizes)")
        return
    if array.dtype.names:
        for field in array.dtype.names:
            _give(output, f"{name}.{field}", array[field], skipped)
    elif array.dtype.kind == "O" and array.size:
        skipped.append(f"{cut(name)} (no array of numbers)")
    elif array.dtype.kind in "biufc":
        array = np.ascontiguousarray(array)
        _line(output, {"name": name, "type": array.dtype.str, "shape": np.shape(value)})
        output.write(array.reshape(-1).view(np.uint8).data if array.size else b"")


def _line(output: IO[bytes], content: dict[str, Any]) -> None:
    output.write(json.dumps(content).encode() + b"\n")
    output.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
