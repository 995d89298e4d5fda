"""The units of one call: what angle, torque and time are multiplied by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._units.channel import unit_said
from tvident._units.quantities import ROTARY, System, UnitError, factor_to, system_of


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
    system = system_of(units["angle"], units["torque"])
    factors = {name: factor_to(system, name, unit, name=f"the {name}") for name, unit in units.items()}
    return Axis(system, **factors, assumed=frozenset(name for name, unit in units.items() if not unit))


def times_in_seconds(t: Any, time_unit: str | None = None) -> Any:
    """Return times in seconds where they have another unit, and otherwise as they are."""
    unit = time_unit or unit_said(t)
    factor = factor_to(ROTARY, "time", unit, name="the time")
    return t if factor == 1 else scaled(np.asarray(t), factor)


def scaled(array: npt.NDArray[Any], factor: float) -> npt.NDArray[Any]:
    """Return an array times a factor; itself where that is 1."""
    if factor == 1:
        return array
    if array.dtype.kind in "mM":
        raise UnitError("dates and durations know their unit; got time_unit too; leave it out")
    wide = array if array.dtype == np.float64 else array.astype(np.float64)
    return np.asarray(wide * factor)
