"""What an angle and a torque may be measured in, and the systems of units that results have."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from tvident._units.parse import Unit, unit_of
from tvident._units.symbols import DOUBTFUL, GRAVITY, NONE, Dimension


class UnitError(ValueError):
    """A unit that cannot be converted."""


_ANGLE, _LENGTH, _TIME = (0, 0, 0, 1, *NONE[4:]), (0, 1, *NONE[2:]), (0, 0, 1, *NONE[3:])
_TORQUE, _FORCE = (1, 2, -2, *NONE[3:]), (1, 1, -2, *NONE[3:])
_AMPERE, _VOLT = (*NONE[:5], 1, *NONE[6:]), (*NONE[:4], 1, *NONE[5:])
_RADIAN = 3
"""Which of the powers of a dimension is that of rad."""

_WEIGHT_ON_AN_ARM = (1, 1, *NONE[2:])
"""kg cm, in-lb: what a mass weighs, on an arm."""

_IN_GRAVITY = dict.fromkeys(("g", "G", "gn", "g_n"), GRAVITY) | {"mg": 1e-3 * GRAVITY}
"""What accelerometers measure in, which is a mass elsewhere."""

_COUNTS = re.compile(r"inc(rement)?s?|incr|counts?|cnts?|ct?s|tic(k)?s?|pulses?|qc|lsb", re.IGNORECASE)
"""What encoders count in."""

_SHOWN = 60
"""Characters of what is no unit."""

_PER_SECOND, _PER_SECOND_SQUARED, _PER_MINUTE = (0, 0, -1, *NONE[3:]), (0, 0, -2, *NONE[3:]), 1 / 60


@dataclass(frozen=True)
class System:
    """Units of a moving axis: of what is recorded, and of what follows."""

    name: str
    units: Mapping[str, str]
    """Of position, effort and time."""
    dimensions: Mapping[str, Dimension] = field(repr=False)


ROTARY = System(
    "rotary", {"angle": "rad", "torque": "N m", "time": "s"}, {"angle": _ANGLE, "torque": _TORQUE, "time": _TIME}
)
LINEAR = System(
    "linear", {"angle": "m", "torque": "N", "time": "s"}, {"angle": _LENGTH, "torque": _FORCE, "time": _TIME}
)

_EXAMPLES = {
    "rad": "rad, mrad, deg, rev",
    "N m": "N m, N mm, kN m, in lbf",
    "m": "m, mm, in",
    "N": "N, kN, lbf",
    "s": "s, ms, min",
}


def system_of(angle: str | None, torque: str | None) -> System:
    """Return the system that the units of an angle and a torque belong to: linear where either says so, rotary otherwise.

    Raises
    ------
    UnitError
        If one belongs to an axis that turns and the other to one that slides.
    """
    said = {_system(text, quantity) for text, quantity in ((angle, "angle"), (torque, "torque"))}
    if said >= {ROTARY.name, LINEAR.name}:
        cure = (
            "give torque_unit='N', say, if the axis slides and this is a force, or angle_unit='deg' if it turns"
            if _system(angle, "angle") == LINEAR.name
            else "give torque_unit='N m', say, if the axis turns, or angle_unit='mm' if it slides and this is a position"
        )
        raise UnitError(
            "angle and torque must be those of one axis, an angle beside a torque or a position beside a force; got "
            f"{angle!r} and {torque!r}; {cure}; if one is scaled by a lever, multiply it by a factor of your own"
        )
    return LINEAR if LINEAR.name in said else ROTARY


def _system(text: str | None, quantity: str) -> str:
    """Return the name of the system whose quantity has this unit; an empty string if it has none, or belongs to neither."""
    return next((one.name for one in (ROTARY, LINEAR) if text and is_convertible(one, quantity, text)), "")


def is_convertible(system: System, quantity: str, text: str) -> bool:
    """Return whether a channel in this unit can be converted to that of a system."""
    unit = unit_of(text) if text else None
    return unit is not None and math.isfinite(_in(unit, system.dimensions[quantity]))


def factor_to(system: System, quantity: str, text: str | None, *, name: str) -> float:
    """Return what a channel is multiplied by to be in the unit of a system.

    Parameters
    ----------
    system : System
        Of the axis.
    quantity : {"angle", "torque", "time"}
        What the channel holds.
    text : str or None
        Its unit; none: that of the system.
    name : str
        What messages call it.

    Raises
    ------
    UnitError
        If the unit is unknown, or of another quantity.
    """
    if not text:
        return 1.0
    wanted = system.units[quantity]
    unit = unit_of(text)
    cure = f"write one of {_EXAMPLES[wanted]}, or give {quantity}_unit='{wanted}' if the numbers are in {wanted}"
    if unit is None and quantity == "angle" and text.strip("[](){}<> .").lower() == "grad":
        raise UnitError(
            f"the unit of {name} must mean one thing; got {text!r}, a degree in German and the 400th part of a turn elsewhere; give "
            "angle_unit='deg' or angle_unit='gon'"
        )
    doubt = DOUBTFUL.get(text.strip("[](){}<> .")) if unit is None else None
    if doubt is not None:
        meant, _, _ = doubt.replace(",", "").partition(" ")
        raise UnitError(
            f"the unit of {name} must mean one thing; got {text.replace('?', '')!r}: {doubt}; give {quantity}_unit={meant!r}, or another"
        )
    part = "; a percentage must be multiplied by the torque of 1 %" if quantity == "torque" and "%" in text else ""
    if quantity == "angle" and _COUNTS.fullmatch(text.strip("[](){}<> .")):
        part = "; multiply counts of an encoder by 2π over those of a turn"
    if unit is None:
        raise UnitError(f"the unit of {name} must be one that is known; got {text[:_SHOWN]!r}; {cure}{part}")
    factor = _in(unit, system.dimensions[quantity])
    if not math.isfinite(factor):
        is_electrical = quantity == "torque" and unit.dimension in {_AMPERE, _VOLT}
        more = part.removeprefix("; ") or (
            "a current or a voltage must be multiplied by the torque of one A or V"
            if is_electrical
            else "a factor of your own converts it too"
        )
        raise UnitError(f"{name} must be in a unit that can be converted to {wanted}; got {text!r}; {cure}; {more}")
    return factor


def _in(unit: Unit, dimension: Dimension) -> float:
    """Return the factor to a dimension, NaN where a unit has another."""
    if unit.dimension == dimension:
        return unit.factor
    if dimension == _TORQUE and unit.dimension == _WEIGHT_ON_AN_ARM:
        return unit.factor * GRAVITY
    return math.nan


def factor_of_derivative(system: System, name: str, text: str) -> float:
    """Return what a recorded velocity or acceleration is multiplied by to be in the unit of a system.

    Parameters
    ----------
    system : System
        Of the axis.
    name : {"velocity", "acceleration"}
        What the channel holds.
    text : str
        Its unit. An acceleration along a line may be in g; 1/min is rpm, and what is counted in a second may be turns or radians.

    Raises
    ------
    UnitError
        If the unit is unknown, of another quantity, or may mean two.
    """
    wanted = system.units["angle"] + {"velocity": "/s", "acceleration": "/s^2"}[name]
    bare = text.strip().strip("[](){}<>").strip()
    if name == "acceleration" and bare in _IN_GRAVITY:
        if system is LINEAR:
            return _IN_GRAVITY[bare]
        raise UnitError(
            f"the acceleration of an axis that turns must be in a unit that can be converted to {wanted}; got {text!r}, that of an "
            f"acceleration along a line; divide it in m/s^2 by its radius in m, or say that the axis slides: torque_unit='N'"
        )
    unit = unit_of(text)
    if unit is not None and system is ROTARY and unit.dimension in {_PER_SECOND, _PER_SECOND_SQUARED}:
        if unit.dimension == _PER_SECOND and math.isclose(unit.factor, _PER_MINUTE):
            return math.tau * unit.factor
        turns = "rpm or rev/s" if unit.dimension == _PER_SECOND else "rev/s^2"
        raise UnitError(
            f"the {name} must say whether radians or turns are counted; got {text!r}; write {wanted}, {turns}, or pass plain "
            f"numbers in {wanted}"
        )
    return factor_between(text, wanted, name=f"the {name}")


def factor_between(text: str, wanted: str, *, name: str) -> float:
    """Return what a parameter in one unit is multiplied by to be in another; rad may be left out, as in N m s for N m s/rad.

    Raises
    ------
    UnitError
        If the unit is unknown, or of another quantity.
    """
    if not text:
        return 1.0
    unit, other = unit_of(text), unit_of(wanted)
    if unit is not None and other is not None:
        without = tuple(0 if base == _RADIAN else power for base, power in enumerate(other.dimension))
        if unit.dimension in {other.dimension, without} and math.isfinite(unit.factor):
            return unit.factor / other.factor
    raise UnitError(
        f"{name} must be in a unit that can be converted to {wanted}; got {text!r}; pass plain numbers in {wanted}"
    )
