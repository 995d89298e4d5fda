"""Reads units as headers of recordings write them, and converts to rad, N m and s."""

from tvident._units.names import named_unit, with_unit
from tvident._units.parse import Unit, is_unit, unit_of
from tvident._units.quantities import LINEAR, ROTARY, System, UnitError, factor_to, system_of

__all__ = [
    "LINEAR",
    "ROTARY",
    "System",
    "Unit",
    "UnitError",
    "factor_to",
    "is_unit",
    "named_unit",
    "system_of",
    "unit_of",
    "with_unit",
]
