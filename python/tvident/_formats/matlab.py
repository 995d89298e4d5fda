"""Variables of MATLAB files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from tvident._arguments import is_called_time
from tvident._formats.columns import COLUMNS
from tvident._formats.matlab_tables import has_objects, tables
from tvident._formats.told import Remark, cut, in_words
from tvident._formats.trajectories import is_of_modelica, trajectories


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every variable, and the fields of structures with names joined by dots."""
    objects = tables(path, skipped) if has_objects(path) else {}
    # What the other reader makes of objects is nothing that anybody called so.
    rest = {
        name: value for name, value in _read(path, skipped).items() if name not in objects and name != "#subsystem#"
    }
    if is_of_modelica(rest):
        yield from trajectories(rest, skipped)
        return
    yield from _flat("", rest, skipped)
    for variable, columns in objects.items():
        prefix = f"{variable}." if len(objects) > 1 or rest else ""
        yield from ((prefix + name, values) for name, values in columns.items())


_VALUES = ("data", "values", "value", "signal", "y")
_UNITS = ("unit", "units")
"""Fields of a structure that is one channel."""
_NAMES = ("name", "names", "label", "channel", "channelname", "signalname", "title", "blockname")
"""Fields of an array of structures that call its channels; a scope of Simulink has a label, which may be empty, and a name of a block."""
_DATA, _HEADER = "_Data", "_Header"
"""Ends of the names of samples and of what is said of them, as catman writes them."""
_SHAPES = ("dimensions",)
"""What Simulink says beside the samples."""


def _read(path: str, skipped: list[str]) -> Mapping[str, Any]:
    """Return all variables; where that fails, one by one those that can be read."""
    from pymatreader import read_mat  # noqa: PLC0415 - within the limits

    try:
        variables = read_mat(path)
    except Exception as error:
        variables = {}
        names = _names(path, error)
        for name in names:
            try:
                variables |= read_mat(path, variable_names=[name])
            except Exception as reason:  # noqa: BLE001 - likewise
                if name.lower() in _UNITS:
                    # Channels would be in others, and numbers a thousand times too large.
                    raise ValueError(f"the units of the channels cannot be read: {in_words(reason)}") from None
                skipped.append(f"{cut(name)} ({in_words(reason)})")
                if name == names[-1]:
                    skipped.append("what may follow it, where the file was cut")
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


def _flat(
    prefix: str, variables: Mapping[str, Any], skipped: list[str], beside: Mapping[str, Any] | None = None
) -> Iterator[tuple[str, Any]]:
    """Give the leaves of nested structures with names joined by dots, and with units where structures, or one beside them, have these."""
    fields = {str(name): value for name, value in variables.items() if not str(name).startswith("__")}
    of_dspace = list(_of_dspace(fields))
    if of_dspace:
        yield from ((prefix + name, value) for name, value in of_dspace)
        return
    fields = _by_column(_with_headers(fields))
    units: Mapping[str, Any] = next(
        (value for name, value in fields.items() if name.lower() in _UNITS and isinstance(value, Mapping)), {}
    )
    of_one, within = _of_structure_beside(fields, units, skipped)
    said = {_alike(name, fields): unit for name, unit in {**(beside or {}), **units}.items()}
    for name, value in fields.items():
        if value is units and units:
            continue
        if not isinstance(value, Mapping):
            yield from _channels(f"{prefix}{name}", said.get(name, ""), value)
            continue
        several = _several_channels(value, skipped)
        if several:
            yield from ((f"{prefix}{name}.{one}", samples) for one, samples in several)
            continue
        channel = _one_channel(value)
        if channel is None:
            of_fields = said.get(name, within if name == of_one else None)
            yield from _flat(f"{prefix}{name}.", value, skipped, of_fields if isinstance(of_fields, Mapping) else None)
            continue
        samples, unit, rest = channel
        yield from _channels(f"{prefix}{name}", unit, samples)
        yield from _flat(f"{prefix}{name}.", rest, skipped)


def _of_structure_beside(
    fields: Mapping[str, Any], units: Mapping[str, Any], skipped: list[str]
) -> tuple[str, Mapping[str, Any]]:
    """Return the structure beside one of units whose fields these name, and the units of them; none where it could be another.

    Units of channels that lie beside them are of those: a structure may hold what was converted. Times may lie anywhere.
    """
    within = {name: unit for name, unit in units.items() if _alike(name, fields) not in fields}
    recorded = [name for name in units if _has_samples(fields.get(_alike(name, fields))) and not is_called_time(name)]
    called = [
        name
        for name, value in fields.items()
        if isinstance(value, Mapping)
        and value is not units
        and any(_has_samples(value.get(_alike(one, value))) for one in within)
    ]
    if recorded or not called:
        return "", {}
    if len(called) > 1:
        several = " and ".join(map(cut, called[:2]))
        skipped.append(Remark(f"the structure of units is not read: {several} have the channels that it names"))
        return "", {}
    return called[0], within


def _alike(name: str, names: Mapping[str, Any]) -> str:
    """Return the only one of some names that differs from this one by capitals alone; itself where there is none, or it is one."""
    found = [one for one in names if one.casefold() == name.casefold()]
    return found[0] if name not in names and len(found) == 1 else name


def _has_samples(value: Any) -> bool:
    return isinstance(value, Mapping) or getattr(value, "size", 1) > 1


def _channels(name: str, unit: Any, samples: Any) -> Iterator[tuple[str, Any]]:
    """Give samples by a name with their unit; the columns of a matrix one by one, as it stands behind their numbers."""
    shape = [length for length in getattr(samples, "shape", ()) if length != 1]
    if not _with_unit("", unit) or len(shape) != 2:  # noqa: PLR2004 - rows and columns
        yield _with_unit(name, unit), samples
        return
    matrix = samples.reshape(shape)
    columns = matrix.T if shape[0] >= shape[1] else matrix
    yield from ((_with_unit(f"{name}.{place}", unit), column) for place, column in enumerate(columns))


def _with_headers(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return variables with what a header beside them says behind their names: ``Channel_1_Data.travel [mm]``, of ``Channel_1_Header``."""
    found: dict[str, Any] = {}
    for name, samples in fields.items():
        header = fields.get(f"{name[: -len(_DATA)]}{_HEADER}") if name.endswith(_DATA) else None
        if not isinstance(header, Mapping) or isinstance(samples, Mapping):
            found[name] = samples
            continue
        lower = {str(key).lower(): value for key, value in header.items()}
        own = next((str(lower[key]).strip() for key in _NAMES if _is_word(lower.get(key))), name)
        unit = next((str(lower[key]).strip() for key in _UNITS if _is_word(lower.get(key))), "")
        found |= _channels(name if own == name else f"{name}.{own}", unit, samples)
    return found


def _by_column(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return variables with the columns of matrices by name, where a list beside them calls as many as these have."""
    lists = {name: words for name, value in fields.items() if (words := _words(value))}
    called = next((one for name, one in lists.items() if COLUMNS.fullmatch(name.lower())), [])
    matrices = [name for name, value in fields.items() if len(called) > 1 and _has_columns(value, len(called))]
    if not matrices:
        return dict(fields)
    units = next((one for name, one in lists.items() if name.lower() in _UNITS and len(one) == len(called)), None)
    found: dict[str, Any] = {}
    for name, value in fields.items():
        if name not in matrices:
            found[name] = value
            continue
        columns = value.T if value.shape[1] == len(called) else value
        for place, (one, samples) in enumerate(zip(called, columns, strict=True)):
            own = one if len(matrices) == 1 else f"{name}.{one}"
            full = _with_unit(own, units[place] if units else "")
            found[full if full not in found and full not in fields else f"{name}.{place}.{full}"] = samples
    return found


def _words(value: Any) -> list[str]:
    """Return the cells of a list of words without blanks around them; nothing where it is none."""
    cells = (
        value.tolist()
        if getattr(getattr(value, "dtype", None), "kind", "") in "UO" and hasattr(value, "tolist")
        else value
    )
    while isinstance(cells, list) and len(cells) == 1:
        cells = cells[0]
    is_words = isinstance(cells, list) and all(map(_is_word, cells))
    return [str(cell).strip() for cell in cells] if is_words else []


def _has_columns(value: Any, count: int) -> bool:
    """Return whether a matrix of numbers has so many columns, or rows."""
    shape = getattr(value, "shape", ())
    is_matrix = len(shape) == 2 and value.dtype.kind in "biuf"  # noqa: PLR2004 - rows and columns
    return is_matrix and count in shape and max(shape) > count


def _with_unit(name: str, unit: Any) -> str:
    return f"{name} [{unit}]" if isinstance(unit, str) and unit else name


def _of_time_series(fields: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a time series without what lies beside its samples and times, of which their units are taken."""
    about = {name: fields[f"{name}Info"] for name in ("Data", "Time") if isinstance(fields.get(f"{name}Info"), Mapping)}
    if not about or not {"Data", "Time"} <= fields.keys():
        return fields
    units = {name: str(one["Units"]).strip() for name, one in about.items() if isinstance(one.get("Units"), str)}
    plain = {name: value for name, value in fields.items() if name not in {"DataInfo", "TimeInfo", "Time"}}
    time = _with_unit("Time", units.get("Time", ""))
    return {"unit": units.get("Data", ""), **plain, time: fields["Time"]}


def _one_channel(fields: Mapping[str, Any]) -> tuple[Any, str, Mapping[str, Any]] | None:
    """Return the samples and the unit of a structure that holds these, and the numbers beside them."""
    fields = _of_time_series(fields)
    lower = {str(name).lower(): value for name, value in fields.items()}
    values = [name for name in _VALUES if name in lower and not isinstance(lower[name], str | Mapping)]
    unit = next((lower[name] for name in _UNITS if isinstance(lower.get(name), str)), None)
    if len(values) != 1 or unit is None:
        return None
    rest = {name: one for name, one in fields.items() if str(name).lower() != values[0] and not isinstance(one, str)}
    return lower[values[0]], unit, rest


def _several_channels(fields: Mapping[str, Any], skipped: list[str]) -> list[tuple[str, Any]]:
    """Return the channels of an array of structures, each with a name, samples and maybe a unit; none where it is something else."""
    lower = {str(name).lower(): value for name, value in fields.items() if str(name).lower() not in _SHAPES}
    values = [name for name in _VALUES if isinstance(lower.get(name), list)]
    if len(values) != 1:
        return []
    samples = lower[values[0]]
    called = [lower[name] for name in _NAMES if isinstance(lower.get(name), list) and len(lower[name]) == len(samples)]
    names = [next((str(one[place]) for one in called if _is_word(one[place])), "") for place in range(len(samples))]
    units = next((lower[name] for name in _UNITS if isinstance(lower.get(name), list)), [""] * len(samples))
    if not all(names) or len(units) != len(samples):
        return []
    used: dict[str, int] = {}
    found: list[tuple[str, Any]] = []
    for name, unit, one in zip(names, units, samples, strict=True):
        used[name] = used.get(name, 0) + 1
        found += _channels(name if used[name] == 1 else f"{name}_{used[name]}", unit, one)
    read = {*values, *_NAMES, *_UNITS, *_SHAPES}
    others = {name: one for name, one in fields.items() if str(name).lower() not in read}
    return [*found, *_flat("", others, skipped)]


def _is_word(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _of_dspace(fields: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Give the channels of a capture of ControlDesk: X holds times, Y has a name, a unit and samples for every channel."""
    inner = fields
    if not {"X", "Y"} <= set(fields):
        captures = [value for value in fields.values() if isinstance(value, Mapping)]
        if len(captures) != 1 or not {"X", "Y"} <= set(captures[0]):
            return
        inner = captures[0]
    x, y = inner["X"], inner["Y"]
    if not (isinstance(y, Mapping) and {"Name", "Data"} <= set(y)):
        return
    if isinstance(x, Mapping) and "Data" in x:
        times = x["Data"]
        yield "time [s]", times[0] if isinstance(times, list) else times
    names, data, units = (
        [one] if not isinstance(one, list) else one for one in (y["Name"], y["Data"], y.get("Unit", []))
    )
    for index, (name, samples) in enumerate(zip(names, data, strict=False)):
        unit = units[index] if index < len(units) and isinstance(units[index], str) else ""
        bare = str(name).replace('"', "").strip()
        yield (f"{bare} [{unit}]" if unit else bare), samples
