"""Describes the equation of motion: kinds of parameters, terms with a name, terms of one's own, units."""

from tvident._choices import BUILT_IN, FRICTION, OFFSET, TERM_NAMES, Kind
from tvident._equation.inner import InnerParameter, expected_stribeck
from tvident._equation.kinds import COEFFICIENTS, Parameter, parameter
from tvident._equation.names import name_of_term
from tvident._equation.terms import FixedTerm, GivenTerm, Term, Unknown, all_terms, has_kind
from tvident._equation.units import LINEAR_UNITS, UNITS

__all__ = [
    "BUILT_IN",
    "COEFFICIENTS",
    "FRICTION",
    "LINEAR_UNITS",
    "OFFSET",
    "TERM_NAMES",
    "UNITS",
    "FixedTerm",
    "GivenTerm",
    "InnerParameter",
    "Kind",
    "Parameter",
    "Term",
    "Unknown",
    "all_terms",
    "expected_stribeck",
    "has_kind",
    "name_of_term",
    "parameter",
]
