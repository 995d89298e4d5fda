"""Variables of netCDF: of version 4, which is HDF5, and of version 3, by SciPy."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from tvident._formats.columns import UNITS, channels_of, first_of, rate_channel
from tvident._formats.hdf5 import datasets, read_whole
from tvident._formats.told import cut

_SINCE = re.compile(r"\s*(\S+)\s+since\s.*", re.IGNORECASE | re.DOTALL)
"""How units of times tell since when they count, of which the unit is taken."""

_NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"

_FILLED = ("_FillValue", "missing_value")


@dataclass(frozen=True)
class NetcdfMeaning:
    """How the numbers of a variable are meant, as its attributes say.

    Parameters
    ----------
    marks : tuple of numbers
        What stands where a value is missing.
    factor, offset : float
        What numbers are multiplied by, and what is added then.
    units : mapping
        The unit as an attribute, where there is one: that of times without since when they count.
    """

    marks: tuple[Any, ...]
    factor: float
    offset: float
    units: Mapping[str, str]

    def of(self, values: Any) -> Any:
        """Return numbers as they are meant, NaN where they are missing."""
        import numpy as np  # noqa: PLC0415 - within the limits

        values = np.asarray(values)
        values = values.astype(values.dtype.newbyteorder("="))
        missing = np.isin(values, np.array(self.marks, values.dtype)) if self.marks else np.zeros(values.shape, bool)
        if (self.factor, self.offset) != (1.0, 0.0):
            values = values.astype(np.float64) * self.factor + self.offset
        return np.where(missing, np.nan, values) if missing.any() else values


def netcdf_meaning(attributes: Mapping[str, Any]) -> NetcdfMeaning:
    """Return how the numbers of a variable with these attributes are meant."""
    import numpy as np  # noqa: PLC0415 - within the limits

    marks = tuple(np.asarray(attributes[key]).reshape(-1)[0] for key in _FILLED if key in attributes)
    factor, offset = (
        default if said is None else float(said)
        for said, default in (
            (first_of(attributes, ["scale_factor"]), 1.0),
            (first_of(attributes, ["add_offset"]), 0.0),
        )
    )
    said = first_of(attributes, UNITS)
    since = _SINCE.fullmatch(said) if isinstance(said, str) else None
    return NetcdfMeaning(marks, factor, offset, {"units": since[1] if since else said} if isinstance(said, str) else {})


def is_netcdf_3(path: str) -> bool:
    """Return whether a file is of version 3, and not of version 4, which is HDF5.

    Raises
    ------
    ValueError
        If it is of a version that is not read, or SciPy, which reads version 3, is not there.
    """
    with open(path, "rb") as file:  # noqa: PTH123 - before anything else is imported
        begin = file.read(4)
    if begin == b"CDF\x05":
        raise ValueError("it is CDF-5, which is not read: convert it with nccopy -k nc4 in.nc out.nc")
    if begin.startswith(b"CDF") and find_spec("scipy") is None:
        raise ValueError("it is netCDF 3, which needs SciPy: pip install 'tvident[io]'")
    return begin.startswith(b"CDF")


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every variable of numbers in its unit, as its attributes scale it, NaN where they say that it is missing."""
    yield from _of_version_3(path, skipped) if is_netcdf_3(path) else _of_version_4(path, skipped)


def _of_version_3(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    from scipy.io import netcdf_file  # noqa: PLC0415 - an extra

    with netcdf_file(path, "r", mmap=False) as file:
        yield from netcdf_3_rate(file, skipped)
        for name, variable, labels in numbers_of_netcdf_3(file, skipped):
            yield from _scaled(name, variable.data.copy(), variable._attributes, labels)  # noqa: SLF001 - likewise


def _of_version_4(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    import h5py  # noqa: PLC0415 - an extra

    with h5py.File(path, "r") as file:
        yield from netcdf_4_rate(file, skipped)
        for name, dataset, labels in numbers_of_netcdf_4(file, skipped):
            values = read_whole(name, dataset, skipped)
            if values is not None:
                yield from _scaled(name, values, dataset.attrs, labels)


def numbers_of_netcdf_3(file: Any, skipped: list[str]) -> Iterator[tuple[str, Any, list[Any]]]:
    """Give every variable of numbers in a file as SciPy opens it: its name, itself, and what names its columns."""
    labels = {name: one.data.copy() for name, one in file.variables.items() if one.data.dtype.kind in "SU"}
    for name, variable in file.variables.items():
        if name in labels:
            is_used = any(name in one.dimensions for other, one in file.variables.items() if other != name)
            skipped += [] if is_used else [f"{cut(name)} (no numbers)"]
            continue
        yield name, variable, [labels[one] for one in variable.dimensions if one in labels]


def numbers_of_netcdf_4(file: Any, skipped: list[str]) -> Iterator[tuple[str, Any, list[Any]]]:
    """Give every variable of numbers in a file as h5py opens it: its name with dots, itself, and what names its columns."""
    import h5py  # noqa: PLC0415 - an extra

    for name, dataset in datasets(file, "", h5py):
        bare = name.replace("/", ".")
        if _is_no_variable(dataset) or (dataset.is_scale and dataset.dtype.kind in "OSU"):
            continue  # what is a dimension of words calls the columns of others
        if dataset.shape is None or dataset.dtype.kind not in "biufc":
            skipped.append(f"{cut(bare)} (no numbers)")
            continue
        scales = [one[0] for one in dataset.dims if len(one)]
        yield bare, dataset, [one[()] for one in scales if one.dtype.kind in "OSU"]


def _is_no_variable(dataset: Any) -> bool:
    """Return whether a dataset only says how long a dimension is."""
    said = dataset.attrs.get("NAME", b"")
    return bool(bytes(said if isinstance(said, bytes) else str(said).encode()).startswith(_NO_VARIABLE))


def netcdf_3_rate(file: Any, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the sample rate in the attributes of a file as SciPy opens it, or else of its variables."""
    parts = [one._attributes for one in file.variables.values()]  # noqa: SLF001 - as SciPy keeps them
    yield from rate_channel(file._attributes, parts, skipped)  # noqa: SLF001 - likewise


def netcdf_4_rate(file: Any, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the sample rate in the attributes of a file as h5py opens it, or else of its variables."""
    import h5py  # noqa: PLC0415 - an extra

    yield from rate_channel(file.attrs, [one.attrs for _, one in datasets(file, "", h5py)], skipped)


def _scaled(name: str, values: Any, attributes: Mapping[str, Any], labels: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    """Give a variable as it is meant; a dimension of words names its columns."""
    meaning = netcdf_meaning(attributes)
    yield from channels_of(name, meaning.of(values), _said(meaning, labels))


def netcdf_columns(name: str, shape: Sequence[int], meaning: NetcdfMeaning, labels: Sequence[Any]) -> list[str]:
    """Return the names, with units, that the channels of a variable of this shape have."""
    import numpy as np  # noqa: PLC0415 - within the limits

    nothing = np.broadcast_to(np.zeros(()), tuple(shape))
    found = list(channels_of(name, nothing, _said(meaning, labels)))
    lengths = [length for length in shape if length > 1]
    if len(found) == 1 and len(lengths) == 2:  # noqa: PLR2004 - rows and columns, which nothing names
        return [f"{name}.{place}" for place in range(min(lengths))]
    return [called for called, _ in found]


def _said(meaning: NetcdfMeaning, labels: Sequence[Any]) -> list[Mapping[str, Any]]:
    return [meaning.units, *({"columns": _words(one)} for one in labels)]


def _words(labels: Any) -> list[str]:
    """Return the words of a variable; characters of version 3 are words along the last dimension."""
    import numpy as np  # noqa: PLC0415 - within the limits

    cells = np.asarray(labels)
    if cells.dtype.kind == "S" and cells.ndim > 1:
        cells = np.array([b"".join(row.tolist()) for row in cells.reshape(-1, cells.shape[-1])])
    return [one.decode(errors="replace") if isinstance(one, bytes) else str(one) for one in cells.reshape(-1).tolist()]
