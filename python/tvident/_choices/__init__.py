"""Names what can be chosen: words for settings, built-in terms, and the version. Without NumPy, for which help need not wait."""

from tvident._choices.built_in import BUILT_IN, FRICTION, OFFSET, TERM_NAMES
from tvident._choices.literals import (
    Criterion,
    Excitation,
    Kind,
    Loss,
    NanPolicy,
    Pattern,
    RowPolicy,
    Selection,
    Variation,
)
from tvident._choices.version import VERSION

__all__ = [
    "BUILT_IN",
    "FRICTION",
    "OFFSET",
    "TERM_NAMES",
    "VERSION",
    "Criterion",
    "Excitation",
    "Kind",
    "Loss",
    "NanPolicy",
    "Pattern",
    "RowPolicy",
    "Selection",
    "Variation",
]
