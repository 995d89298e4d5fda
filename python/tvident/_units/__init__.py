"""Reads units as headers of recordings write them, and converts to rad, N m and s."""

from tvident._units.axis import Axis, axis_of, factor_said, scaled, times_in_seconds
from tvident._units.channel import (
    Channel,
    has_unit_in_attributes,
    in_its_unit,
    may_count_samples,
    unit_named,
    unit_said,
)
from tvident._units.names import derivative_units, named_unit, with_ending, with_unit
from tvident._units.parse import Unit, is_unit, unit_of, without_brackets
from tvident._units.quantities import (
    LINEAR,
    ROTARY,
    System,
    UnitError,
    factor_between,
    factor_of_derivative,
    factor_to,
    is_convertible,
    system_of,
)
from tvident._units.rates import rate_of, rate_said
from tvident._units.words import QUOTED, in_words_of

__all__ = [
    "LINEAR",
    "QUOTED",
    "ROTARY",
    "Axis",
    "Channel",
    "System",
    "Unit",
    "UnitError",
    "axis_of",
    "derivative_units",
    "factor_between",
    "factor_of_derivative",
    "factor_said",
    "factor_to",
    "has_unit_in_attributes",
    "in_its_unit",
    "in_words_of",
    "is_convertible",
    "is_unit",
    "may_count_samples",
    "named_unit",
    "rate_of",
    "rate_said",
    "scaled",
    "system_of",
    "times_in_seconds",
    "unit_named",
    "unit_of",
    "unit_said",
    "with_ending",
    "with_unit",
    "without_brackets",
]
