"""Expands parameters in functions of time or of a recorded channel: families, sizes by a criterion, weighted rows in weak form."""

from tvident._expansion.basis import Basis, Coordinate
from tvident._expansion.expansion import Expansion
from tvident._expansion.fit import Curves, Fitted, Linearised
from tvident._expansion.rivals import Rival, scatter
from tvident._expansion.rows import Record, Unknown
from tvident._expansion.search import DERIVATIVES, SLACK, Part, Search, Tried, along_record, curves_of, errors_along

__all__ = [
    "DERIVATIVES",
    "SLACK",
    "Basis",
    "Coordinate",
    "Curves",
    "Expansion",
    "Fitted",
    "Linearised",
    "Part",
    "Record",
    "Rival",
    "Search",
    "Tried",
    "Unknown",
    "along_record",
    "curves_of",
    "errors_along",
    "scatter",
]
