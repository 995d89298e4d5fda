"""Names of channels that hold their units: ``angle [deg]``, ``Torque (Nmm)``, ``t/ms``, ``knee_angle_deg``."""

from __future__ import annotations

import re

from tvident._units.parse import unit_of

_IN_BRACKETS = re.compile(
    r"(.*?)[\s_/]*(?:\[([^\[\]]*)\]|\(([^()]*(?:\([^()]*\))?[^()]*)\)|\{([^{}]*)\}|<([^<>]*)>)\s*", re.DOTALL
)
_BEHIND_A_SIGN = re.compile(r"(.+?)\s*(?:(?<![/\s])\s*/\s*|,\s*|\s+in\s+)([^,]+)", re.DOTALL)
_BEHIND_A_LINE = re.compile(r"(.+)_(deg|degrees|rad|mrad|Nm|Nmm|mNm|ms|us|sec|mm|rpm)")
"""Of units that are written behind a line, those that are no name of anything else."""


def named_unit(name: str) -> tuple[str, str]:
    """Return a channel's name without its unit, and the unit; an empty string if it has none.

    What stands in brackets is the unit, whatever it is; behind a slash, a comma or a line only what is known as one.
    """
    found = _IN_BRACKETS.fullmatch(name)
    if found and found[1]:
        unit = next(one for one in found.groups()[1:] if one is not None).strip()
        inner, known = named_unit(found[1]) if unit_of(unit) is None else ("", "")
        return (f"{inner} ({unit})", known) if unit_of(known) is not None else (found[1], unit)
    for pattern in (_BEHIND_A_SIGN, _BEHIND_A_LINE):
        found = pattern.fullmatch(name)
        if found and unit_of(found[2]) is not None and unit_of(name) is None:
            return found[1], found[2].strip()
    return name, ""


def derivative_units(unit: str, count: int) -> list[str]:
    """Return the units of a channel and its derivatives by time in seconds; empty strings if the channel has none."""
    base = f"({unit})" if "/" in unit else unit
    powers = ["", "/s", *(f"/s^{order}" for order in range(2, count))]
    return [base + power if unit and power else unit for power in powers[:count]]


def with_unit(name: str, unit: str) -> str:
    """Return a name with a unit in brackets behind it, where there is one."""
    return f"{name} [{unit}]" if unit else name
