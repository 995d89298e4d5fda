"""A channel of a recording: an array that knows its unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from reprlib import repr as _shown
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from tvident._units.names import named_unit
from tvident._units.parse import unit_of
from tvident._units.quantities import ROTARY, UnitError, factor_to, is_convertible

_SIGNS, _SUMS = (np.negative, np.positive, np.absolute, np.fabs), (np.add, np.subtract)
"""What leaves the unit as it is; sums where whatever is added has no other."""

_RARE = 1.5e-6
"""Seconds from one sample to the next, at most, that few recorders reach."""

_ROUNDED = 1e-6
"""By how much a whole number of milliseconds or microseconds may be another one, for rounding."""

_JOINED = (np.concatenate, np.stack, np.vstack, np.hstack, np.column_stack)


def _check_text(unit: object) -> None:
    """Raise TypeError if a unit is no text."""
    if not isinstance(unit, str):
        raise TypeError(f"a unit must be a text; got {_shown(unit)}; pass 'rad', 'N m' or another")


class Channel(np.ndarray[Any, Any]):
    """Samples with their unit, as :func:`tvident.read_recording` gives them: an array in every other way.

    Slices, copies and what is joined of one unit keep the unit, and so do signs and sums: ``-torque``, ``angle - angle.mean()``,
    ``t - t[0]``. What else is computed from samples is a plain array, since its unit is another.

    Attributes
    ----------
    unit : str
        As the file writes it; empty where it has none.

    See Also
    --------
    tvident.read_recording : returns recordings with such channels.

    References
    ----------
    NumPy documentation, "Subclassing ndarray": how slices and copies keep what an array knows.
    docs/files.md, "Units".

    Examples
    --------
    >>> import tvident
    >>> tvident.simulate_torsional_rig(duration=1.0).save("rig.csv")
    >>> angle = tvident.read_recording("rig.csv")["angle"]
    >>> angle[:100].unit
    'rad'
    >>> type(angle * 2).__name__
    'ndarray'
    """

    unit: str

    def __new__(cls, samples: npt.ArrayLike, unit: str = "") -> Self:
        """Give samples a unit, without a copy."""
        _check_text(unit)
        graph = getattr(samples, "__dask_graph__", None)
        if graph is not None and graph() is not None:
            raise TypeError(
                "samples must be in memory; got a dask collection, which may be larger than memory and is never computed silently; pass "
                "samples.compute()"
            )
        try:
            channel = np.asarray(samples).view(cls)
        except ValueError:
            raise ValueError(
                f"samples must be a regular array of numbers; got {_shown(samples)}; give all rows the same length"
            ) from None
        channel.unit = unit
        return channel

    def __array_finalize__(self, other: Any) -> None:
        self.unit = getattr(other, "unit", "")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """Compute with plain arrays: a product or a mean of channels has another unit, or none; a sign and a sum keep it."""
        unit = _kept(ufunc, method, inputs)
        if "out" in kwargs:
            kwargs["out"] = tuple(np.asarray(one) if isinstance(one, Channel) else one for one in kwargs["out"])
        plain = (np.asarray(one) if isinstance(one, Channel) else one for one in inputs)
        made = getattr(ufunc, method)(*plain, **kwargs)
        return Channel(made, unit) if unit and isinstance(made, np.ndarray) else made

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        """Keep the unit where channels of one unit are joined: what was not computed has no other."""
        made = super().__array_function__(func, types, args, kwargs)
        if func in _JOINED and args and isinstance(args[0], list | tuple):
            units = {one.unit if isinstance(one, Channel) else None for one in args[0]}
            if len(units) == 1 and None not in units:
                return Channel(made, self.unit)
        return made

    def to(self, unit: str) -> Channel:
        """Return the samples in another unit.

        Parameters
        ----------
        unit : str
            Such as ``"rad"``, ``"N m"`` or ``"s"``.

        Returns
        -------
        Channel, same shape

        Raises
        ------
        ValueError
            If one of the units is unknown, or they measure different quantities.

        See Also
        --------
        tvident.identify : converts channels by itself.
        """
        _check_text(unit)
        here, there = unit_of(self.unit), unit_of(unit)
        if here is None or there is None or here.dimension != there.dimension or not here.factor > 0 < there.factor:
            raise UnitError(
                f"a unit is converted to one of the same quantity; got {_shown(self.unit)} and {_shown(unit)}; multiply by a "
                "factor of your own"
            )
        return Channel(np.asarray(self) * (here.factor / there.factor), unit)

    def __reduce__(self) -> Any:
        return Channel, (np.asarray(self), self.unit)


def _kept(ufunc: Any, method: str, inputs: tuple[Any, ...]) -> str:
    """Return the unit that what is computed still has; an empty string where it has another, or none."""
    if method != "__call__" or ufunc not in (*_SIGNS, *_SUMS):
        return ""
    units = list(dict.fromkeys(one.unit for one in inputs if isinstance(one, Channel)))
    if len({(known.dimension, known.factor) if (known := unit_of(unit)) else unit for unit in units}) > 1:
        raise UnitError(
            f"what is added must be in one unit; got {_shown(units[0])} and {_shown(units[1])}; convert one with "
            f".to({units[0]!r}), or take plain numbers with np.asarray()"
        )
    return units[0] if units else ""


def unit_said(values: Any) -> str:
    """Return the unit that an array says it has; an empty string if it says none.

    Channels of ours say it, quantities of pint, astropy and unyt, and attributes of xarray and pandas; of a list all that it holds.

    Raises
    ------
    UnitError
        If what a list holds has several.
    """
    if isinstance(values, list | tuple):
        return _common(unit_said, values)
    if isinstance(values, Channel):
        return values.unit
    if hasattr(values, "magnitude") and hasattr(values, "units"):
        return _unit_of_pint(values.units)
    if isinstance(values, np.ndarray):
        said = getattr(values, "units", None) or getattr(values, "unit", None)
        return "" if said is None else str(said)
    return _in_attributes(values)


def has_unit_in_attributes(values: Any) -> bool:
    """Return whether an attribute of a container alone says its unit: what is computed from it keeps the attribute."""
    if isinstance(values, list | tuple):
        return bool(values) and has_unit_in_attributes(values[0])
    # Of a file that is open nothing was computed.
    computes = hasattr(values, "to_numpy") and not hasattr(values, "magnitude")
    return computes and not isinstance(values, np.ndarray) and bool(_in_attributes(values))


def is_computed_label(values: Any) -> bool:
    """Return whether values of xarray are called as a coordinate of theirs and are other numbers: they were computed from it."""
    coordinates, name = getattr(values, "coords", None), getattr(values, "name", None)
    if not isinstance(coordinates, Mapping) or name not in coordinates or getattr(values, "chunks", None):
        return False
    label = np.asarray(coordinates[name])
    return label.shape == np.shape(values) and not np.array_equal(label, np.asarray(values))


def _in_attributes(values: Any) -> str:
    attributes = getattr(values, "attrs", None)
    if not isinstance(attributes, Mapping):
        return ""
    said = attributes.get("units") or attributes.get("unit")
    return said if isinstance(said, str) else ""


def _common(unit: Callable[[Any], str], values: Sequence[Any]) -> str:
    """Return the unit of all records of a list; plain numbers have none."""
    if not values or isinstance(values[0], int | float):
        return ""
    units = list(dict.fromkeys(unit(one) for one in values))
    if len(units) > 1:
        raise UnitError(
            f"records of a list must have one unit; got {', '.join(repr(one) for one in units)}; convert them with Channel.to"
        )
    return units[0]


def _unit_of_pint(unit: Any) -> str:
    """Return the symbols of a unit, rather than its words."""
    try:
        return f"{unit:~}"
    except (ValueError, TypeError):
        return str(unit)


def unit_named(values: Any) -> str:
    """Return the unit in the name of a series, or that of all columns of a table: ``angle [deg]``; empty if it is not known.

    What is computed from a series keeps its name, so nobody knows whether the numbers are still in this unit.
    """
    # What is lazy may work long for its names, and is refused later.
    if isinstance(values, list | tuple):
        return _common(unit_named, values)
    columns = getattr(values, "columns", None) if hasattr(values, "to_numpy") else None
    names = [getattr(values, "name", None)] if columns is None else list(columns)
    units = {_unit_of_levels(name) for name in names if isinstance(name, str | tuple)}
    unit = units.pop() if len(units) == 1 else ""
    return unit if unit_of(unit) is not None else ""


def _unit_of_levels(name: str | tuple[Any, ...]) -> str:
    """Return the unit in a name, of several levels in the one that has one: ``("elbow", "angle [deg]")``, ``("angle", "deg")``."""
    levels = (name,) if isinstance(name, str) else name
    units = dict.fromkeys(named_unit(level)[1] for level in levels if isinstance(level, str))
    known = [unit for unit in units if unit and unit_of(unit) is not None]
    return known[0] if len(known) == 1 else ""


def are_as_named(times: Any, unit: str) -> bool:
    """Return whether times are in the part of a second that their name says: whole numbers are, as those made seconds of would be none."""
    if not is_convertible(ROTARY, "time", unit) or factor_to(ROTARY, "time", unit, name="the time") >= 1:
        return False
    numbers = np.asarray(times)
    if numbers.ndim != 1 or numbers.dtype.kind not in "iuf" or numbers.size < 2:  # noqa: PLR2004 - a step
        return False
    whole = np.round(numbers)
    is_whole = bool((np.abs(numbers - whole) <= _ROUNDED).all() and whole[0] != whole[-1])
    return is_whole and not may_count_samples(whole, unit)


def may_count_samples(times: npt.NDArray[Any], unit: str) -> bool:
    """Return whether times that are in microseconds or less by their name go up by one: a million samples a second, or their numbers."""
    if not is_convertible(ROTARY, "time", unit) or factor_to(ROTARY, "time", unit, name="the time") > _RARE:
        return False
    return times.ndim == 1 and times.size > 1 and bool((np.diff(times) == 1).all())


def in_its_unit(values: Any) -> Any:
    """Return the numbers of a quantity of pint; anything else as it is."""
    return values.magnitude if hasattr(values, "magnitude") and hasattr(values, "units") else values
