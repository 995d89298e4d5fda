"""Reasons and advice, as sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

TRIED = "of what is held back are predicted"
"""What advice says that was tried on the record."""

BECOMES = " becomes "
"""Between a parameter and the value that a better equation gives it, in advice."""

OF_WEAK_FORM = "the weak form finds other numbers"
"""How advice begins where the strong form is contradicted, with the same equation."""

OTHER_UNIT = ("degrees?", "is the time in ")
"""How advice asks about units, of which all numbers depend."""

MARKED = "does it mark values that are missing?"
"""How advice asks about numbers that may never have been measured."""

STAYS = "or use method='auto', which "
"""How advice goes on about what spoils windows of the strong form, which nothing took out."""

WRITTEN_OVER = "the arrays that were given hold other samples by now"
"""How advice says that nobody can look at a recording any more."""

FED_BACK = "the torque holds the angle's noise"
UNTOLD_LAG = "the record does not tell half a sample of lag"
NOT_CONSTANT = " was given as constant, but parts of the record differ"
UNFOLLOWED = " differs between parts of the record, and nothing that follows it explains that"
CONDITIONS = (FED_BACK, UNTOLD_LAG, NOT_CONSTANT)
"""What advice says on which errors depend."""


@dataclass(frozen=True)
class Words:
    """What was chosen and why, and what is worth doing about it."""

    reasons: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
    each: tuple[Words, ...] = ()
    """The same of every record of a batch."""

    def __add__(self, other: Words) -> Words:
        return Words(self.reasons + other.reasons, self.advice + other.advice, self.each)


def of_batch(each: Sequence[Words]) -> Words:
    """Return what there is to say of several records: advice alone, since reasons differ too much from one to the next."""
    advice = tuple(f"record {place}: {line}" for place, words in enumerate(each) for line in words.advice)
    return Words((), advice, tuple(each))


def with_written_over(words: Words) -> Words:
    """Return words that begin with why nothing is tried of a record, or said of it that was not said before."""
    line = (
        f"{WRITTEN_OVER}: what they held when they were identified cannot be looked at, and what would explain more was not tried; ask "
        "for trusted or summary() before you write into them, or give copies"
    )
    return words if line in words.advice else Words(words.reasons, (line, *words.advice), words.each)
