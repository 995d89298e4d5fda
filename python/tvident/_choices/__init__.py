"""Names what can be chosen: words for settings, and built-in terms. Without NumPy, for which help need not wait."""

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

__all__ = [
    "BUILT_IN",
    "FRICTION",
    "OFFSET",
    "TERM_NAMES",
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
