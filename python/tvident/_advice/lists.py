"""Lists within sentences."""

from __future__ import annotations

from collections.abc import Sequence


def listed(names: Sequence[str]) -> str:
    """Return names as they are read: one, another and a third."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
