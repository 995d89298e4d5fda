"""What a result says in words: the part that all kinds of results share."""

from __future__ import annotations

from functools import cached_property

from tvident._results.words import Words


class Telling:
    """The part of a result that says why and what to do; what there is to say is found when it is asked for."""

    @cached_property
    def _told(self) -> Words:
        raise NotImplementedError

    @property
    def reasons(self) -> tuple[str, ...]:
        """What was chosen, and why."""
        return self._told.reasons

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do about what looks wrong."""
        return self._told.advice
