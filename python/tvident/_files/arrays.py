"""Arrays in files of NumPy and MATLAB."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tvident._files.channels import Channels, FileError


def _numeric(named: Iterable[tuple[str, Any]]) -> Channels:
    """Return what can be a channel or a number: real arrays, each column of a matrix on its own."""
    channels: Channels = {}
    for name, value in named:
        array = np.asarray(value)
        if array.dtype.names:
            channels |= _numeric((f"{name}.{field}" if name else field, array[field]) for field in array.dtype.names)
            continue
        if array.dtype.kind not in "biuf" or array.size == 0:
            continue
        array = array.squeeze()
        if array.ndim < 2:  # noqa: PLR2004 - a vector or a number
            channels[name or "0"] = array
        elif array.ndim == 2:  # noqa: PLR2004 - a matrix
            columns = array if array.shape[0] >= array.shape[1] else array.T
            prefix = f"{name}." if name else ""
            channels |= {f"{prefix}{index}": column for index, column in enumerate(columns.T)}
    return channels


def read_npy(path: Path) -> Channels:
    return _numeric([("", np.load(path, allow_pickle=False))])


def read_npz(path: Path) -> Channels:
    with np.load(path, allow_pickle=False) as archive:
        return _numeric((name, archive[name]) for name in archive.files)


def read_matlab(path: Path) -> Channels:
    try:
        from pymatreader import read_mat  # noqa: PLC0415 - optional
    except ImportError:
        raise FileError(f"{path}: MATLAB files need pymatreader; install it with: pip install 'tvident[io]'") from None
    with path.open("rb"):
        pass  # a missing file says so in the same words as any other
    try:
        variables = read_mat(str(path))
    except Exception as error:  # noqa: BLE001 - readers of foreign formats raise anything
        raise FileError(f"{path}: cannot be read as a MATLAB file ({error}); save it again with -v7") from None
    return _numeric(_flat("", variables))


def _flat(prefix: str, variables: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """Return the leaves of nested structures with names joined by dots."""
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _flat(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value
