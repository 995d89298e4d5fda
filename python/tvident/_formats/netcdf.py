"""Variables of netCDF: of version 4, which is HDF5, and of version 3, by SciPy."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tvident._formats.columns import UNITS, channels_of, first_of, rate_in
from tvident._formats.hdf5 import datasets, read_whole
from tvident._formats.told import cut

_SINCE = re.compile(r"\s*(\S+)\s+since\s.*", re.IGNORECASE | re.DOTALL)
"""How units of times tell since when they count, of which the unit is taken."""

_NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"

_FILLED = ("_FillValue", "missing_value")


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every variable of numbers in its unit, as its attributes scale it, NaN where they say that it is missing."""
    with open(path, "rb") as file:  # noqa: PTH123 - before anything else is imported
        begin = file.read(4)
    if begin == b"CDF\x05":
        raise ValueError("it is CDF-5, which is not read: convert it with nccopy -k nc4 in.nc out.nc")
    yield from _of_version_3(path, skipped) if begin.startswith(b"CDF") else _of_version_4(path, skipped)


def _of_version_3(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    try:
        from scipy.io import netcdf_file  # noqa: PLC0415 - an extra
    except ImportError:
        raise ValueError("it is netCDF 3, which needs SciPy: pip install 'tvident[io]'") from None
    with netcdf_file(path, "r", mmap=False) as file:
        yield from _rate(file._attributes, [one._attributes for one in file.variables.values()], skipped)  # noqa: SLF001 - as SciPy keeps them
        labels = {name: one[:] for name, one in file.variables.items() if one.data.dtype.kind in "SU"}
        for name, variable in file.variables.items():
            if name in labels:
                is_used = any(name in one.dimensions for other, one in file.variables.items() if other != name)
                skipped += [] if is_used else [f"{cut(name)} (no numbers)"]
                continue
            beside = [labels[one] for one in variable.dimensions if one in labels]
            yield from _scaled(name, variable[:].copy(), variable._attributes, beside)  # noqa: SLF001 - likewise


def _of_version_4(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    import h5py  # noqa: PLC0415 - an extra

    with h5py.File(path, "r") as file:
        found = dict(datasets(file, "", h5py))
        yield from _rate(file.attrs, [one.attrs for one in found.values()], skipped)
        for name, dataset in found.items():
            bare = name.replace("/", ".")
            if _is_no_variable(dataset) or (dataset.is_scale and dataset.dtype.kind in "OSU"):
                continue  # what is a dimension of words calls the columns of others
            if dataset.shape is None or dataset.dtype.kind not in "biufc":
                skipped.append(f"{cut(bare)} (no numbers)")
                continue
            values = read_whole(bare, dataset, skipped)
            if values is None:
                continue
            scales = [one[0] for one in dataset.dims if len(one)]
            beside = [one[()] for one in scales if one.dtype.kind in "OSU"]
            yield from _scaled(bare, values, dataset.attrs, beside)


def _is_no_variable(dataset: Any) -> bool:
    """Return whether a dataset only says how long a dimension is."""
    said = dataset.attrs.get("NAME", b"")
    return bool(bytes(said if isinstance(said, bytes) else str(said).encode()).startswith(_NO_VARIABLE))


def _rate(
    whole: Mapping[str, Any], parts: Sequence[Mapping[str, Any]], skipped: list[str]
) -> Iterator[tuple[str, Any]]:
    import numpy as np  # noqa: PLC0415 - within the limits

    rate = rate_in(whole, parts, skipped)
    if rate is not None:
        yield "sample_rate [Hz]", np.float64(rate)


def _scaled(name: str, values: Any, attributes: Mapping[str, Any], labels: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    """Give a variable as it is meant; a dimension of words names its columns."""
    import numpy as np  # noqa: PLC0415 - within the limits

    values = np.asarray(values)
    values = values.astype(values.dtype.newbyteorder("="))
    marks = [np.asarray(attributes[key]).reshape(-1)[0] for key in _FILLED if key in attributes]
    missing = np.isin(values, np.array(marks, values.dtype)) if marks else np.zeros(values.shape, bool)
    factor, offset = (
        default if said is None else float(said)
        for said, default in (
            (first_of(attributes, ["scale_factor"]), 1.0),
            (first_of(attributes, ["add_offset"]), 0.0),
        )
    )
    if (factor, offset) != (1.0, 0.0):
        values = values.astype(np.float64) * factor + offset
    if missing.any():
        values = np.where(missing, np.nan, values)
    said = first_of(attributes, UNITS)
    since = _SINCE.fullmatch(said) if isinstance(said, str) else None
    own = {"units": since[1] if since else said} if isinstance(said, str) else {}
    columns = [{"columns": _words(one)} for one in labels]
    yield from channels_of(name, values, [own, *columns])


def _words(labels: Any) -> list[str]:
    """Return the words of a variable; characters of version 3 are words along the last dimension."""
    import numpy as np  # noqa: PLC0415 - within the limits

    cells = np.asarray(labels)
    if cells.dtype.kind == "S" and cells.ndim > 1:
        cells = np.array([b"".join(row.tolist()) for row in cells.reshape(-1, cells.shape[-1])])
    return [one.decode(errors="replace") if isinstance(one, bytes) else str(one) for one in cells.reshape(-1).tolist()]
