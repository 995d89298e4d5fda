"""Sentences about one record."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Words:
    """Sentences about one record: what was chosen and why, and what is worth doing about it."""

    reasons: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()


def listed(names: list[str]) -> str:
    """Return names as they are read: one, another and a third."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
