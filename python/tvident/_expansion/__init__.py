"""Expands parameters in functions of time or of a recorded channel: families, sizes by a criterion, weighted rows in weak form."""

from tvident._expansion.basis import Basis, Coordinate
from tvident._expansion.expansion import Expansion
from tvident._expansion.families import family_from, plain_family
from tvident._expansion.fit import Curves, Fitted, Linearised
from tvident._expansion.rivals import Rival, Rivals
from tvident._expansion.rows import ExpandedRecord, ExpandedUnknown, condition_of_curves, placed, reach_over
from tvident._expansion.search import (
    DERIVATIVES,
    SLACK,
    RecordPart,
    SizeSearch,
    Tried,
    along_record,
    curve_along,
    curves_of,
)
from tvident._expansion.steps import variance_of_steps

__all__ = [
    "DERIVATIVES",
    "SLACK",
    "Basis",
    "Coordinate",
    "Curves",
    "ExpandedRecord",
    "ExpandedUnknown",
    "Expansion",
    "Fitted",
    "Linearised",
    "RecordPart",
    "Rival",
    "Rivals",
    "SizeSearch",
    "Tried",
    "along_record",
    "condition_of_curves",
    "curve_along",
    "curves_of",
    "family_from",
    "placed",
    "plain_family",
    "reach_over",
    "variance_of_steps",
]
