"""Terms of a chain that windows follow, or that act where no torque is known: what a first look sees is tried in full."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tvident._equation import BUILT_IN
from tvident._identify.left_over import AS_GOOD
from tvident._identify.look_at_masses import Acting, LookAtMasses
from tvident._identify.offered import BEYOND_CHANCE
from tvident._merged import (
    AskedTogether,
    Chain,
    LackingTerm,
    LackingTerms,
    Masses,
    MergedIdentification,
    Part,
    TermValues,
    angles_of,
    identify_masses,
    link_of,
    parts_of_result,
    that_lacks,
)
from tvident._results import unflagged
from tvident._status import Status

_NO_WORSE = 2.0
"""Times the error of prediction that a chain with more terms has at most: each is over the noise of another test function."""

_MOST = 3
"""Terms that are tried in full at most."""


def with_lacking(
    found: MergedIdentification, masses: Sequence[Masses], asked: AskedTogether, values: TermValues
) -> MergedIdentification:
    """Return a result that says which term a chain lacks where the core cannot, and whose errors hold what that changes.

    Parameters
    ----------
    found : MergedIdentification
    masses : sequence of Masses
        Of every trial.
    asked : AskedTogether
    values : TermValues
    """
    return _ChainTried(found, masses, asked, values).result()


@dataclass(frozen=True)
class _Better:
    """What a chain lacks, and the error of predicting its equations with that, over the noise's."""

    lacking: LackingTerms
    error: float


@dataclass(frozen=True)
class _ChainTried:
    """A result of masses, and how they are identified again."""

    found: MergedIdentification
    masses: Sequence[Masses]
    asked: AskedTogether
    values: TermValues

    def result(self) -> MergedIdentification:
        """Return the result, with what is lacking if anything is."""
        if not self._may_lack:
            return self.found
        tried: list[_Better] = []
        for terms in self._worth_a_trial[:_MOST]:
            trial = self._with(terms)
            tried += [] if trial is None else [trial]
            if trial is not None and trial.error <= AS_GOOD:
                break
        if not tried:
            return self.found
        best = min(tried, key=lambda one: one.error).lacking
        # What the core names it says itself.
        return that_lacks(self.found, replace(best, terms=()) if self._part.found.terms else best)

    @property
    def _may_lack(self) -> bool:
        """Whether something changes that may follow a term, or a joint has no torque on either end, and nobody says so yet."""
        structure, parts = self.masses[0].structure, parts_of_result(self.found)
        if not isinstance(structure, Chain) or len(parts) != 1 or parts[0].equations.expansions:
            return False
        is_named = bool(parts[0].found.terms) and not unflagged(self.found).any()
        if is_named or self.found.record_status & Status.RANK_DEFICIENT:
            return False
        driven = {mass for one in self.masses for mass in one.driven}
        links = [*structure.springs, *(structure.dampers or ())]
        return "windowed" in self.found.kinds.values() or any(driven.isdisjoint(link) for link in links)

    @property
    def _part(self) -> Part:
        return parts_of_result(self.found)[0]

    @property
    def _worth_a_trial(self) -> list[Sequence[Acting]]:
        """What is tried: what is named already, together, then what a first look sees, the most first."""
        seen: list[Sequence[Acting]] = [
            [one] for one in LookAtMasses(self.found, self._part, self.masses, self.values).seen()
        ]
        return [self._named, *seen] if self._named else seen

    @property
    def _named(self) -> list[Acting]:
        """Terms that the core suspects; none where a mass has one of its own beside a moving base, which no link says."""
        angles, masses = angles_of(self._part), self.masses[0]
        each = [
            (name, link_of(angles, mass, against, masses.count), angles[mass])
            for mass, against, name, _ in self._part.found.terms
        ]
        if len(masses.angles) > masses.count and any(link is None for _, link, _ in each):
            return []
        return [(name, link or ("base", mass)) for name, link, mass in each]

    def _with(self, terms: Sequence[Acting]) -> _Better | None:
        """Return what a chain with more terms changes; None where they are not there, or predict far worse."""
        structure: Any = self.masses[0].structure
        more = replace(structure, terms=[*structure.terms, *terms])
        asked = replace(self.asked, report=None)
        if asked.earlier is not None:
            # Lengths that were chosen follow what is missing.
            asked = replace(asked, earlier=None, forms=[dict.fromkeys(asked.forms[0])])
        try:
            found = identify_masses([replace(one, structure=more) for one in self.masses], asked, self.values)
        except ValueError:
            return None
        told = []
        for name, link in terms:
            value, error, *_ = found.value("_".join((name, *map(str, link))))
            if not abs(value) > BEYOND_CHANCE * error or (value < 0 and BUILT_IN[name].dissipates):
                return None
            told.append(LackingTerm(name, link, value, error))
        error, before = (one.settings["prediction_error"][0] for one in (found, self.found))
        if not error <= _NO_WORSE * before:
            return None
        changes = {
            name: np.abs(np.nan_to_num(found.elements[name] - values)) for name, values in self.found.elements.items()
        }
        return _Better(LackingTerms(told, changes), error)
