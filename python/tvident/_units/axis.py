"""The units of one call: what angle, torque and time are multiplied by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from tvident._units.channel import (
    are_as_named,
    has_unit_in_attributes,
    in_its_unit,
    is_computed_label,
    unit_named,
    unit_said,
)
from tvident._units.quantities import LINEAR, ROTARY, System, UnitError, factor_to, is_convertible, system_of

# What has no place to say a unit: the only ones that come a thousand times a second.
_WITHOUT_UNIT: Final = frozenset((np.ndarray, float))


@dataclass(frozen=True)
class Axis:
    """How the channels of a call become rad, N m and s, or m, N and s.

    Parameters
    ----------
    system : System
        Units of results.
    angle, torque, time : float
        What the channels are multiplied by.
    assumed : frozenset of str
        Those of the three of which nobody said the unit.
    """

    system: System = ROTARY
    angle: float = 1.0
    torque: float = 1.0
    time: float = 1.0
    assumed: frozenset[str] = frozenset()


def axis_of(
    angle: Any,
    torque: Any,
    t: Any = None,
    *,
    angle_unit: str | None = None,
    torque_unit: str | None = None,
    time_unit: str | None = None,
) -> Axis:
    """Return how channels are converted: by the units that are given, or else those that the arrays say they have.

    Raises
    ------
    ValueError
        If a unit is unknown, or of another quantity than its channel.
    TypeError
        If it is no text.
    """
    given = {"angle": angle_unit, "torque": torque_unit, "time": time_unit}
    for name, unit in given.items():
        if unit is not None and not isinstance(unit, str):
            raise TypeError(f"{name}_unit must be text; got {type(unit).__name__}; write 'deg', 'N m' or 'ms', say")
    values = {"angle": angle, "torque": torque, "time": t}
    units = {name: unit or unit_said(values[name]) for name, unit in given.items()}
    named = {name: unit_named(values[name]) for name, unit in units.items() if not unit}
    # A name that a product kept, as that of a current times a constant, says nothing.
    units |= {
        name: unit for name, unit in named.items() if any(is_convertible(one, name, unit) for one in (ROTARY, LINEAR))
    }
    system = system_of(units["angle"], units["torque"])
    for name in named:
        if units[name] and not (name == "time" and are_as_named(t, units[name])):
            _check_named(system, name, units[name])
    for name, unit in given.items():
        # Coordinates of time say their unit in no other way.
        is_doubtful = has_unit_in_attributes(values[name]) if name != "time" else is_computed_label(values[name])
        if not unit and is_doubtful:
            _check_named(system, name, units[name], by="an attribute", what="arithmetic keeps attributes")
    factors = {name: factor_to(system, name, unit, name=f"the {name}") for name, unit in units.items()}
    return Axis(system, **factors, assumed=frozenset(name for name, unit in units.items() if not unit))


def factor_said(system: System, name: str, values: Any) -> float:
    """Return what a channel is multiplied by to be in the unit of a system, by the unit that it says it has itself.

    Raises
    ------
    UnitError
        If it cannot be converted, or only a name says it.
    """
    if type(values) in _WITHOUT_UNIT:
        return 1.0
    unit = unit_said(values)
    if has_unit_in_attributes(values):
        _check_named(system, name, unit, by="an attribute", what="arithmetic keeps attributes")
    if unit:
        return factor_to(system, name, unit, name=f"the {name}")
    _check_named(system, name, unit_named(values))
    return 1.0


def _check_named(
    system: System,
    name: str,
    unit: str,
    *,
    by: str = "its name",
    what: str = "what is computed from a series keeps the name",
    has_argument: bool = True,
) -> None:
    """Refuse a unit that only a name or an attribute says, where the numbers may have been converted since."""
    wanted = system.units[name]
    argument = (
        f"give {name}_unit={unit!r}, or {name}_unit={wanted!r} if they were converted, or " if has_argument else ""
    )
    if is_convertible(system, name, unit) and factor_to(system, name, unit, name=f"the {name}") != 1:
        raise UnitError(
            f"the {name} must say its unit where {by} says {unit!r}: {what}, so nobody knows "
            f"whether the numbers still are; {argument}pass .to_numpy() in {wanted}"
        )


def times_in_seconds(t: Any, time_unit: str | None = None, *, has_argument: bool = False) -> Any:
    """Return times in seconds where they have another unit, and otherwise as they are; messages name the argument where there is one."""
    unit = time_unit or unit_said(t)
    if not unit and getattr(getattr(t, "dtype", None), "kind", "") not in {"m", "M"}:
        named = unit_named(t)
        if are_as_named(t, named):
            unit = named
        _check_named(ROTARY, "time", "" if unit else named, has_argument=has_argument)
    if not time_unit and is_computed_label(t):
        what = "arithmetic keeps attributes"
        _check_named(ROTARY, "time", unit, by="an attribute", what=what, has_argument=has_argument)
    factor = factor_to(ROTARY, "time", unit, name="the time")
    # What says or is called by another unit than the one that was given would be converted by whoever takes it next.
    is_plain = factor == 1 and (time_unit is None or not (unit_said(t) or unit_named(t)))
    return t if is_plain else scaled(np.asarray(in_its_unit(t)), factor)


def scaled(array: npt.NDArray[Any], factor: float) -> npt.NDArray[Any]:
    """Return an array times a factor; itself where that is 1."""
    if factor == 1:
        return array
    if array.dtype.kind in "mM":
        raise UnitError("dates and durations know their unit; got time_unit too; leave it out")
    if array.dtype.kind not in "biuf":
        return array  # which whoever takes it refuses in words of its own
    wide = array if array.dtype == np.float64 else array.astype(np.float64)
    with np.errstate(all="ignore"):  # what leaves the range of doubles is no sample
        return np.asarray(wide * factor)
