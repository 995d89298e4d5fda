"""What a result says in words: the part that all kinds of results share."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from tvident._results.words import Words
from tvident._units import in_words_of


class Telling:
    """The part of a result that says why and what to do; what there is to say is found when it is asked for.

    Attributes
    ----------
    units : mapping of str to str
        Of results.
    """

    units: Mapping[str, str]

    @cached_property
    def _told(self) -> Words:
        raise NotImplementedError

    @property
    def _chosen(self) -> Words:
        """What was chosen, which stands before what would be better is looked for."""
        return self._told

    @property
    def reasons(self) -> tuple[str, ...]:
        """What was chosen, and why: a tuple of sentences.

        See Also
        --------
        advice : what to do.
        summary : both, with the numbers.
        """
        return self._in_own_words(self._chosen.reasons)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do about what looks wrong: a tuple of sentences.

        See Also
        --------
        reasons : what was chosen.
        record_status : the flags behind it.
        """
        return self._in_own_words(self._told.advice)

    def _in_own_words(self, sentences: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(in_words_of(self.units, one) for one in sentences)
