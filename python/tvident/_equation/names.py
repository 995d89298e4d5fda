"""Names of terms: what they may be made of, and which are taken."""

from __future__ import annotations

import re

from tvident import _arguments as arguments
from tvident._choices import TERM_NAMES
from tvident._equation.kinds import COEFFICIENTS

_MOST_LETTERS = 60

_RULE = re.compile(r"[^\W\d_][\w .\-]*")
"""A letter first: files of results are read by programs that take other signs for formulas, options or numbers."""

_COLUMNS = (
    "time",
    *COEFFICIENTS,
    "natural_frequency",
    "damping_ratio",
    "condition",
    "residual_std",
    "order",
    "status",
    "record_status",
    "trusted",
    "velocity_bias",
    "acceleration_bias",
)
"""Columns of every result."""

_CHANNELS = ("angle", "velocity", "acceleration", "torque", "mask")

_ERRORS = "stderr"
"""Ends the name of a column of standard errors."""

_TAKEN = frozenset((*_COLUMNS, *_CHANNELS, *TERM_NAMES))


def name_of_term(name: object) -> str:
    """Return the name of a user's term, if it can stand beside the names of a result."""
    if not isinstance(name, str):
        raise TypeError(f"the name of a term must be a word; got {arguments.shown(name)}; write Term('drag', function)")
    got = f"got {arguments.shown(name)}"
    if not _RULE.fullmatch(name) or name != name.strip() or len(name) > _MOST_LETTERS:
        raise ValueError(
            f"the name of a term must begin with a letter and hold nothing but letters, digits, spaces, '_', '-' and '.', at most "
            f"{_MOST_LETTERS} of them; {got}; call it 'drag', say"
        )
    plain = re.sub(r"[ .\-]", "_", name.casefold())
    if plain in _TAKEN or plain.endswith(_ERRORS):
        own = f"own {plain.removesuffix(_ERRORS)[:20]}".rstrip(" _")
        why = f"names that end in {_ERRORS!r} are" if plain.endswith(_ERRORS) else "this name is"
        raise ValueError(f"the name of a term must be its own; {got}; {why} taken in results: call it {own!r}, say")
    return name
