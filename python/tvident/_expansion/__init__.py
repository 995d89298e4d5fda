"""Expands parameters in functions of time or of a recorded channel: families, sizes by a criterion, weighted rows in weak form."""

from tvident._expansion.alignment import AlignedSamples
from tvident._expansion.basis import Basis, Coordinate
from tvident._expansion.coordinates import (
    Rates,
    check_expansion,
    part_of,
    refuse,
    refuse_windows,
    with_channels,
)
from tvident._expansion.expansion import Expansion
from tvident._expansion.families import family_from, plain_family
from tvident._expansion.fit import MORE_THAN_NOISE, Fitted, Linearised
from tvident._expansion.rivals import Rival, Rivals
from tvident._expansion.rows import (
    Curves,
    ExpandedRecord,
    ExpandedUnknown,
    Places,
    condition_of_curves,
    curve_length,
    of_one,
    placed,
    reach_over,
    spread_of,
)
from tvident._expansion.search import (
    DERIVATIVES,
    SLACK,
    RecordPart,
    SizeSearch,
    Tried,
    along_record,
    curve_along,
    curves_of,
    rates_of,
)
from tvident._expansion.steps import variance_of_steps
from tvident._expansion.whitened_rows import Noise, with_least_noise

__all__ = [
    "DERIVATIVES",
    "MORE_THAN_NOISE",
    "SLACK",
    "AlignedSamples",
    "Basis",
    "Coordinate",
    "Curves",
    "ExpandedRecord",
    "ExpandedUnknown",
    "Expansion",
    "Fitted",
    "Linearised",
    "Noise",
    "Places",
    "Rates",
    "RecordPart",
    "Rival",
    "Rivals",
    "SizeSearch",
    "Tried",
    "along_record",
    "check_expansion",
    "condition_of_curves",
    "curve_along",
    "curve_length",
    "curves_of",
    "family_from",
    "of_one",
    "part_of",
    "placed",
    "plain_family",
    "rates_of",
    "reach_over",
    "refuse",
    "refuse_windows",
    "spread_of",
    "variance_of_steps",
    "with_channels",
    "with_least_noise",
]
