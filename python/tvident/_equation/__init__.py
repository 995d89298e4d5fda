"""Says what stands in the equation of motion: coefficients of a kind, terms, their units."""

from tvident._equation.kinds import COEFFICIENTS, Kind, Parameter, parameter
from tvident._equation.terms import Term, TermName, Unknown, all_terms
from tvident._equation.units import UNITS

__all__ = [
    "COEFFICIENTS",
    "UNITS",
    "Kind",
    "Parameter",
    "Term",
    "TermName",
    "Unknown",
    "all_terms",
    "parameter",
]
