"""Terms whose factors are expansions: which they are, and windows in their place."""

from __future__ import annotations

from typing import Any

from tvident._equation import Term, has_kind
from tvident._expansion import Expansion


def expansions_of_terms(terms: Any) -> dict[str, Expansion]:
    """Return the expansions that are asked for, by the names of terms."""
    found = {}
    for term in terms if isinstance(terms, tuple | list) else ():
        if has_kind(term) and isinstance(term[1], Expansion):
            found[term[0].name if isinstance(term[0], Term) else str(term[0])] = term[1]
    return found


def in_windows(terms: Any) -> Any:
    """Return terms with windows in the place of expansions."""
    if not isinstance(terms, tuple | list):
        return terms
    return [(term[0], "windowed") if has_kind(term) and isinstance(term[1], Expansion) else term for term in terms]
