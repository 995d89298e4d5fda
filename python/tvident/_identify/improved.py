"""Words of a doubtful record that begin with what leads to the answer, found by trying."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tvident import _core
from tvident._advice import Explained
from tvident._equation import BUILT_IN, Unknown
from tvident._identify.data import Data
from tvident._identify.methods import WeakForm
from tvident._identify.remedies import Trial
from tvident._identify.settings import Request, resolve
from tvident._results import Identification, Words
from tvident._identify.spikes import without_spikes
from tvident._status import Status
from tvident._units import ROTARY

_LENGTHS = ("window_length", "exponent", "regression_window")
"""Arguments of the form that a trial may keep."""

_LARGE = 0.4
"""Radians beyond which a pendulum is no spring: the sine is 2.6 % smaller than its angle."""

_DOUBTED = (
    Status.TERM_SUSPECTED | Status.LAG_SUSPECTED | Status.NOISE_MODEL | Status.WINDOW_LIMIT | Status.SCALES_DISAGREE
)

_MENDED_FIRST = {"held", "wrapped"}
"""Defects of a channel beside which no other equation tells anything: what would be found is the recorder's."""


def is_to_be_tried(data: Data, request: Request, found: Sequence[_core.Identification]) -> bool:
    """Return whether something speaks against the model of a single record in weak form, and there is something to change."""
    if not isinstance(request.form, WeakForm) or data.instruments is not None or data.batch:
        return False
    if any(defect in _MENDED_FIRST for _, defect, _ in found[0].defects):
        return False
    flags = found[0].record_status
    if flags & Status.RANK_DEFICIENT:
        # What is missing may hide what the motion explains.
        return found[0].unexplained
    # Inertia and damping that change take the place of what is missing.
    changing = any(one.kind == "varying" for one in found[0].unknowns)
    return bool(flags & _DOUBTED) or changing


def is_doubted(flags: int) -> bool:
    """Return whether something speaks against the model of a record."""
    return bool(flags & _DOUBTED)


def of_one(
    data: Data, request: Request, flags: int, run: Callable[..., Identification]
) -> Callable[[Any, Words], Words] | None:
    """Return what tries the remedies of one record of several, as if it had been identified alone; None where nothing is to be tried.

    Settings of an earlier result are those of the batch, so nothing is tried with them.
    """
    is_repeated = bool(request.by_record) or request.lag_samples is not None
    if not isinstance(request.form, WeakForm) or data.instruments is not None or is_repeated or not is_doubted(flags):
        return None

    def improve(_: Any, words: Words) -> Words:
        return replace(words, advice=run(progress=None, diagnose=True).advice)

    return improve


@dataclass(frozen=True)
class Improvement:
    """A single record, and how to identify it with another equation.

    Parameters
    ----------
    data : Data
    request : Request
    found : _core.Identification
    given : mapping of str to object
        Inertia, damping and stiffness as they were asked for.
    terms : sequence of Unknown
    run : callable
        Identifies data as a request asks.
    """

    data: Data
    request: Request
    found: _core.Identification
    given: Mapping[str, Any]
    terms: Sequence[Unknown]
    run: Callable[..., Identification]

    def words(self, result: Identification, words: Words) -> Words:
        """Return words that begin with what to change, without what was tried in vain."""
        terms = [term.own or term.name for term in self.terms]
        trial = Trial(self._identify, result, self.given, terms, self._suspects)
        advice = trial.advice()
        useless, given_well = ([], []) if advice is not None else trial.useless()
        dropped = self._explained.suspicions(self._suspects if advice is not None else useless)
        starts = tuple(f"{name} was given as constant" for name in given_well)
        hidden = (
            self._explained.words().advice
            if advice is not None and result.record_status & Status.RANK_DEFICIENT
            else ()
        )
        dropped += hidden[-1:]  # that nothing is explained, which it is with what is advised
        rest = [line for line in words.advice if line not in dropped and not line.startswith(starts)]
        return replace(words, advice=tuple(rest if advice is None else (advice, *rest)))

    @cached_property
    def _explained(self) -> Explained:
        names = [
            *(name for name, kind in self.given.items() if isinstance(kind, str)),
            *(one.name for one in self.terms),
        ]
        return Explained(self.found, names, (), (), self.data.period, self.data.step, units=self.data.units)

    @cached_property
    def _suspects(self) -> list[str]:
        """What may be missing: what the core suspects, friction and a lag, and anything where the equations of no scale can be believed."""
        suspects = [one.name for one in self._explained.suspects]
        others = ["lag", "coulomb"]
        angles = without_spikes(self.data, [self.found]).angles
        is_large = float(np.nanmax(np.abs(angles), initial=0.0)) > _LARGE
        if self.data.axis.system is ROTARY and ("cubic" in suspects or is_large):
            others.append("gravity")
        if self.found.record_status & Status.SCALES_DISAGREE:
            others += [name for name, term in BUILT_IN.items() if not getattr(term, "inner", ())]
        present = {*suspects, *(one.name for one in self.terms)}
        return suspects + [name for name in dict.fromkeys(others) if name not in present]

    def _identify(self, *, lag: Any, terms: Any, diagnose: bool = False, **given: Any) -> Identification:
        form = WeakForm(**{name: given.pop(name) for name in _LENGTHS if name in given})
        asked = {**given, "terms": terms, "lag": lag, "quantisation": self.request.quantisation}
        # An angle that turns is unwrapped by now.
        request = replace(resolve(form, asked, None, 1 / self.data.period), period=self.request.period)
        return self.run(request, replace(self.data, step=1, labels=None, doubts=()), diagnose=diagnose)
