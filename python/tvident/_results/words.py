"""Reasons and advice, as sentences."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Words:
    """What was chosen and why, and what is worth doing about it."""

    reasons: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
