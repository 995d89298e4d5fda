"""Reads the variables of a MATLAB file in a process of its own, since a damaged file can crash or block its reader.

``matlab`` starts it: ``python matlab_variables.py FILE BYTES SECONDS``. It imports nothing of the package. It writes to standard
output, for every array of numbers, a line of JSON with its name, type and shape, then its bytes; at the end a line that says what
was not read, and why nothing was.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterator, Mapping
from typing import IO, Any


def main(path: str, most_bytes: str, most_seconds: str) -> None:
    _limit(int(most_bytes), int(most_seconds))
    output = sys.stdout.buffer
    sys.stdout = sys.stderr
    warnings.simplefilter("ignore")  # classes of MATLAB: what cannot be read is said below
    skipped: list[str] = []
    error = ""
    try:
        for name, value in _flat("", _variables(path, skipped)):
            _give(output, name, value, skipped)
    except BaseException as one:  # noqa: BLE001 - readers of foreign formats raise anything
        error = _in_words(one)
    _line(output, {"skipped": [_cut(one) for one in skipped], "error": error})


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


def _variables(path: str, skipped: list[str]) -> Mapping[str, Any]:
    """Return all variables; where that fails, one by one those that can be read."""
    from pymatreader import read_mat  # noqa: PLC0415 - within the limits

    try:
        variables = read_mat(path)
    except Exception as error:
        variables = {}
        for name in _names(path, error):
            try:
                variables |= read_mat(path, variable_names=[name])
            except Exception as reason:  # noqa: BLE001 - likewise
                skipped.append(f"{_cut(name)} ({_in_words(reason)})")
        if not variables:
            raise
    return variables


def _names(path: str, error: Exception) -> list[str]:
    from scipy.io import whosmat  # noqa: PLC0415 - within the limits

    try:
        return [name for name, _, _ in whosmat(path)]
    except NotImplementedError:  # version 7.3
        import h5py  # noqa: PLC0415 - within the limits

        with h5py.File(path, "r") as file:
            return [name for name in file if name != "#refs#"]
    except Exception:  # noqa: BLE001 - the first error says more
        raise error from None


def _flat(prefix: str, variables: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Give the leaves of nested structures with names joined by dots."""
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _flat(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value


def _give(output: IO[bytes], name: str, value: Any, skipped: list[str]) -> None:
    import numpy as np  # noqa: PLC0415 - within the limits

    try:
        array = np.asarray(value)
    except ValueError:
        skipped.append(f"{_cut(name)} (cells of different sizes)")
        return
    if array.dtype.names:
        for field in array.dtype.names:
            _give(output, f"{name}.{field}", array[field], skipped)
    elif array.dtype.kind == "O" and array.size:
        skipped.append(f"{_cut(name)} (no array of numbers)")
    elif array.dtype.kind in "biufc":
        array = np.ascontiguousarray(array)
        _line(output, {"name": name, "type": array.dtype.str, "shape": np.shape(value)})
        output.write(array.reshape(-1).view(np.uint8).data if array.size else b"")


def _line(output: IO[bytes], content: dict[str, Any]) -> None:
    output.write(json.dumps(content).encode() + b"\n")
    output.flush()


def _in_words(error: BaseException) -> str:
    return "too large" if isinstance(error, MemoryError) else _cut(str(error) or type(error).__name__)


def _cut(text: str) -> str:
    return text[:200]


if __name__ == "__main__":
    main(*sys.argv[1:])
