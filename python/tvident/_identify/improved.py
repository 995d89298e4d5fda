"""Words of a doubtful record that begin with what leads to the answer, found by trying."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from tvident import _core
from tvident._advice import NOT_DISTINGUISHED, Explained, in_vain
from tvident._clocks import bridged
from tvident._equation import BUILT_IN, COEFFICIENTS, FRICTION, OFFSET, Unknown
from tvident._identify.data import Data, cut
from tvident._identify.exchanged import asked_of_exchanged, takes_work
from tvident._identify.free_offset import without_worse_offset
from tvident._identify.methods import StrongForm, WeakForm
from tvident._identify.offered import NEXT_TO_NOTHING, contradicted, is_right
from tvident._identify.remedies import Trial
from tvident._identify.settings import Request, resolve
from tvident._identify.signals import with_own_step
from tvident._identify.tried_record import CONTRADICTED
from tvident._identify.used import as_used
from tvident._results import MARKED, NOT_CONSTANT, TRIED, Identification, Words, median_of
from tvident._status import Status
from tvident._units import ROTARY

_LENGTHS = ("window_length", "exponent", "regression_window")
"""Arguments of the form that a trial may keep."""

_LARGE = 0.4
"""Radians beyond which a pendulum is no spring: the sine is 2.6 % smaller than its angle."""

TESTED = {"inertia": "auto", "damping": "auto", "stiffness": "windowed"}
"""Kinds that the weak form tests, and the one that it takes, in place of windows that the strong form has."""

_MOST = 1 << 14
"""Samples in the middle of a record that are tried in weak form."""

_PART, _FUNCTIONS = 1 << 14, 64
"""Samples, and test functions, that tell what is missing."""

_LONG = 1 << 15
"""Samples from which on a record is tried on a part of it."""

_SHORT = 1 << 16
"""Samples up to which an offset that is free in every window is tried on the whole record."""

_READ = 1 << 11
"""Samples of a part that tell how busy it is."""

_DOUBTED = (
    Status.TERM_SUSPECTED | Status.LAG_SUSPECTED | Status.NOISE_MODEL | Status.WINDOW_LIMIT | Status.SCALES_DISAGREE
)

_MENDED_FIRST = {"held", "wrapped"}
"""Defects of a channel beside which no other equation tells anything: what would be found is the recorder's."""


def is_to_be_tried(data: Data, request: Request, found: Sequence[_core.Identification]) -> bool:
    """Return whether something contradicts the model of a single record in weak form, and there is something to change."""
    if not isinstance(request.form, WeakForm) or data.instruments is not None or data.batch:
        return False
    if _is_marked(data) or any(defect.name in _MENDED_FIRST for defect in found[0].defects):
        return False
    flags = found[0].record_status
    if flags & Status.RANK_DEFICIENT:
        # What is missing may hide what the motion explains.
        return found[0].unexplained
    return found[0].free_offset is not None or _is_contradicted(found[0])


def _is_contradicted(found: _core.Identification) -> bool:
    """Return whether something contradicts the model, or may hide what does.

    Inertia and damping that change take the place of what is missing.
    """
    return bool(found.record_status & _DOUBTED) or any(one.kind == "varying" for one in found.unknowns)


def is_told_by_weak_form(data: Data, request: Request) -> bool:
    """Return whether a record is a single one in strong form, of which the weak form takes any part as well."""
    return isinstance(request.form, StrongForm) and data.is_plain and data.time.size > 0 and not _is_marked(data)


def _is_marked(data: Data) -> bool:
    """Return whether it is asked if numbers mark missing values: whatever is tried would explain what was never measured."""
    return any(MARKED in line for _, line in data.doubts)


def is_doubted(flags: int) -> bool:
    """Return whether something contradicts the model of a record."""
    return bool(flags & _DOUBTED)


def of_one(
    data: Data,
    request: Request,
    flags: Any,
    run: Callable[..., Identification],
    in_weak_form: Callable[[Sequence[Any]], Callable[[Any, Words], Words] | None],
) -> Callable[[Any, Words], Words] | None:
    """Return what tries the remedies of one record of several, as if it had been identified alone; None where nothing is to be tried.

    Settings of an earlier result are those of the batch, so nothing is tried with them. Of strong form the weak form tells more.
    """
    if data.batch:
        return None
    if is_told_by_weak_form(data, request):
        return in_weak_form(())
    is_repeated = bool(request.by_record) or request.lag_samples is not None
    if (
        not isinstance(request.form, WeakForm)
        or data.instruments is not None
        or is_repeated
        or not is_doubted(int(flags))
    ):
        return None

    def improve(_: Any, words: Words) -> Words:
        # Whatever is tried would explain what was never measured.
        if any(MARKED in line for line in words.advice):
            return words
        return replace(words, advice=run(progress=None, diagnose=True).advice)

    return improve


@dataclass(frozen=True)
class _AskedOfRecord:
    """A single record, and what was asked of it.

    Parameters
    ----------
    data : Data
    request : Request
    given : mapping of str to object
        Inertia, damping and stiffness as they were asked for.
    terms : sequence of Unknown
    run : callable
        Identifies data as a request asks.
    """

    data: Data
    request: Request
    given: Mapping[str, Any]
    terms: Sequence[Unknown]
    run: Callable[..., Identification]

    @property
    def asked_terms(self) -> list[Any]:
        """Terms as users give them: by name, or their own."""
        return [term.own or term.name for term in self.terms]


@dataclass(frozen=True)
class TriedInWeakForm(_AskedOfRecord):
    """A single record in strong form, of which the weak form tells what to change: its windows follow whatever is missing."""

    def words(self, result: Identification, words: Words) -> Words:
        """Return words that begin with what explains more in weak form, if anything does, or with what it finds elsewhere."""
        try:
            weak = self._in_weak_form(self._part())
        except ValueError:
            # The part is too short for the weak form, or nothing of it is there.
            return words
        remedy = next((line for line in weak.advice if TRIED in line), None)
        if remedy is None:
            return self._unless_contradicted(result, weak, words)
        remedies = (f"in weak form: {remedy}", *_not_constant(weak))
        starts = tuple(beginning for one in BUILT_IN.values() for beginning in one.beginnings)
        rest = [line for line in words.advice if not (line.startswith(starts) and ": give terms=" in line)]
        return replace(words, advice=(*remedies, *rest))

    def _unless_contradicted(self, strong: Identification, weak: Identification, words: Words) -> Words:
        """Return words that begin with what the weak form finds elsewhere of a part of the record, where nothing contradicts it."""
        # What a recorder spoilt is left out there, and said.
        if weak.record_status & CONTRADICTED & ~Status.CHANNEL_SUSPECTED:
            return replace(words, advice=(*_not_constant(weak), *words.advice))
        begin, end = weak.time[[0, -1]].tolist()
        part = strong.between(begin, end)
        elsewhere = contradicted(
            weak, {name: median_of(part, name) for name in COEFFICIENTS if isinstance(self.given[name], str)}
        )
        if elsewhere is None:
            return words
        rest = [line for line in words.advice if line not in weak.advice]
        return replace(words, advice=(elsewhere, *weak.advice, *rest))

    def _part(self) -> slice:
        """Return the part of the record that is tried: its middle, or where the mask leaves most."""
        count, mask = self.data.time.size, self.data.mask
        first = max(0, count - _MOST) // 2
        if mask is not None and count > _MOST:
            left = np.concatenate([[0], np.cumsum(mask)])
            first = int(np.argmax(left[_MOST:] - left[:-_MOST]))
        return slice(first, first + _MOST)

    def _in_weak_form(self, some: slice) -> Identification:
        data = self.data
        kinds = {
            name: ("constant" if kind == "constant" else TESTED[name]) if isinstance(kind, str) else cut(kind, some)
            for name, kind in self.given.items()
        }
        asked = {**kinds, "terms": self.asked_terms, "lag": self.request.lag}
        request = replace(resolve(WeakForm(), asked, None, 1 / data.period), period=self.request.period)
        part = data.stretch(some)
        over_gaps = bridged({"angle": part.angles, "torque": part.torques}, None, part.workers)
        if over_gaps is not None:
            # Polynomials do without what is missing, rows of the weak form are gone with it.
            request = with_own_step(request, {"angle": part.angles})
            channels, passed = over_gaps.channels, over_gaps.passed
            part = replace(
                part,
                angles=channels["angle"],
                torques=channels["torque"],
                clock=over_gaps.after(part.clock),
                passed=(passed.get("angle"), passed.get("torque")),
            )
        return self.run(request, part, diagnose=True)


def _not_constant(weak: Identification) -> list[str]:
    """Return what the weak form says of parameters that were given as constant and are not, which the strong form does not test."""
    return [f"in weak form: {line}" for line in weak.advice if NOT_CONSTANT in line]


def _busiest(data: Data, length: int) -> slice:
    """Return the part of a record, of so many samples, in which the middle half of the torque spreads most where anything is told."""
    torque, angle, mask = data.torques, data.angles, data.mask
    # An odd step meets every sample of what comes at even ones.
    every = (length // _READ) | 1
    starts = range(0, torque.size - length + 1, length)

    def spread(start: int) -> float:
        some = slice(start, start + length, every)
        is_there = np.isfinite(torque[some]) & np.isfinite(angle[some])
        there = torque[some][is_there if mask is None else is_there & mask[some]]
        # Half a part that is missing tells half as much.
        return float(np.subtract(*np.percentile(there, [75, 25]))) * there.size if there.size else 0.0

    first = max(starts, key=spread)
    return slice(first, first + length)


@dataclass(frozen=True)
class Improvement(_AskedOfRecord):
    """A single record, and how to identify it with another equation.

    Parameters
    ----------
    found : _core.Identification
        With the equation that was asked for.
    """

    found: _core.Identification

    def words(self, result: Identification, words: Words) -> Words:
        """Return words that begin with what to change, without what was tried in vain."""
        if not (_is_contradicted(self.found) or self.found.record_status & Status.RANK_DEFICIENT):
            return self._without_worse_offset(result, words)
        trial = self._trial(result)
        remedy, exchanged = trial.remedy(), None
        if remedy is None or remedy.share > NEXT_TO_NOTHING:
            # Of a slow machine a lag explains most of what swapped channels leave.
            exchanged = self._exchanged(result)
            remedy = remedy if exchanged is None else None
        advice, suspects = exchanged if remedy is None else remedy.words, self._suspects
        if advice is None and (undoubted := trial.undoubted(self._undoubted)):
            suspects, advice = list(undoubted[0]), undoubted[1]
        free = trial.set_free(remedy) if advice is not None and exchanged is None else None
        if free is not None:
            remedy, suspects, advice = free, self._suspects, free.words
        if advice is None:
            # Beside other advice this comes later.
            words = self._without_worse_offset(result, words)
        useless, given_well = ([], []) if advice is not None else trial.useless()
        conspicuous = self._explained.suspects
        denied = {} if advice is not None else trial.denied(conspicuous)
        dropped = self._explained.suspicions(suspects if advice is not None else [*useless, *denied])
        if advice is None:
            # Flags stay, and so does what they say.
            left = [one for one in conspicuous if one.name not in denied]
            words = replace(words, advice=(*in_vain(left, useless), *denied.values(), *words.advice))
        starts = tuple(f"{name} was given as constant" for name in given_well)
        hidden = (
            self._explained.words().advice
            if advice is not None and result.record_status & Status.RANK_DEFICIENT
            else ()
        )
        dropped += hidden[-1:]  # that nothing is explained, which it is with what is advised
        rest = [line for line in words.advice if line not in dropped and not line.startswith(starts)]
        if remedy is not None and remedy.separates:
            rest = [line for line in rest if NOT_DISTINGUISHED not in line]
        # What is tried differs little from what it is compared with where unknowns cannot be distinguished.
        before = next((place + 1 for place, line in enumerate(rest) if NOT_DISTINGUISHED in line), 0)
        return replace(words, advice=(*rest[:before], *([] if advice is None else [advice]), *rest[before:]))

    def _without_worse_offset(self, result: Identification, words: Words) -> Words:
        terms = [*(term for term in self.asked_terms if term != OFFSET), (OFFSET, "windowed")]
        with_offset = partial(self._identify, self.data, **self.given, terms=terms, lag=self.request.lag)
        return without_worse_offset(words, result, with_offset) if self.data.time.size < _SHORT else words

    def _trial(self, result: Identification) -> Trial:
        """Return the trial of the record, or of its busiest part where that tells as much."""
        data, some = self.data, self._busiest_part
        trial = partial(
            Trial,
            terms=self.asked_terms,
            suspects=self._suspects,
            beyond_chance=[one.name for one in self._explained.suspects],
            others=self._others,
        )
        if some is not None:
            given = {name: kind if isinstance(kind, str) else cut(kind, some) for name, kind in self.given.items()}
            identify = partial(self._identify, data.stretch(some))
            try:
                found = identify(**given, terms=self.asked_terms, lag=self.request.lag, diagnose=True)
                there = result.between(*data.time[some][[0, -1]].tolist())
            except ValueError:
                # So little of the part is there that nothing can be identified in it.
                found = None
            if found is not None:
                is_as_asked = self.request.lag != "auto"
                return trial(identify, found, given, is_as_asked=is_as_asked, at_hand=there, whole=result)
        return trial(partial(self._identify, data), result, self.given, is_as_asked=self._is_as_asked)

    @cached_property
    def _busiest_part(self) -> slice | None:
        """The part of a long record that tells as much of its equation as the whole; None of other records."""
        part = max(_PART, _FUNCTIONS * (self.found.window_length or 0))
        is_long = self.data.is_plain and self.data.time.size >= max(_LONG, 2 * part)
        return _busiest(self.data, part) if is_long else None

    @property
    def _is_as_asked(self) -> bool:
        """Whether the record was identified as a trial with the same equation: all else automatic, nothing from an earlier result."""
        asked = self.request
        from_earlier = (asked.lag_samples, asked.angle_zero, asked.shown_noise)
        is_new = not (asked.by_record or asked.kept or asked.inner) and all(one is None for one in from_earlier)
        unknown = [kind for kind in self.given.values() if isinstance(kind, str)]
        # Without a kind a term is windowed where all parameters are.
        is_usual = any(kind != "windowed" for kind in unknown) and all(
            one.kind in {"auto", "constant"} for one in self.terms
        )
        return is_new and is_usual and self.data.step == 1 and asked.lag != "auto" and asked.form == WeakForm()

    def _exchanged(self, result: Identification) -> str | None:
        """Return the question whether channels are swapped; None where nothing says so."""
        data = self.data
        if data.motion.recorded or not all(isinstance(kind, str) for kind in self.given.values()):
            return None
        if takes_work(data.angles, data.torques, data.mask):
            return None
        channels = replace(
            data, angles=data.torques, torques=data.angles, passed=data.passed[::-1], labels=None, doubts=(), step=1
        )
        part = self._busiest_part

        def exchanged(stiffness: str) -> Identification:
            kinds = {"inertia": "constant", "damping": "constant", "stiffness": stiffness}
            request = resolve(WeakForm(), {**kinds, "terms": [OFFSET], "lag": 0.0}, None, 1 / data.period)
            if part is None:
                return self.run(request, channels, diagnose=False)
            found = self.run(request, channels.stretch(part), diagnose=False)
            is_all = stiffness == "windowed" and is_right(found)
            return self.run(request, channels, diagnose=False) if is_all else found

        return asked_of_exchanged(exchanged, lambda: result)

    @cached_property
    def _explained(self) -> Explained:
        names = [
            *(name for name, kind in self.given.items() if isinstance(kind, str)),
            *(one.name for one in self.terms),
        ]
        return Explained(self.found, names, (), (), self.data.period, self.data.step, units=self.data.units)

    @property
    def _undoubted(self) -> list[str]:
        """What may be missing where prediction tells nothing: what the core suspects, and what changes may take the place of."""
        suspects = [one.name for one in self._explained.suspects]
        return suspects or (self._suspects if any(one.kind == "varying" for one in self.found.unknowns) else [])

    @cached_property
    def _suspects(self) -> list[str]:
        """What may be missing: what the core suspects, friction and a lag, and anything where widths disagree or unknowns look alike."""
        suspects = [one.name for one in self._explained.suspects]
        others = ["lag", FRICTION]
        angles = as_used(self.data, [self.found]).angles
        is_large = float(np.nanmax(np.abs(angles), initial=0.0)) > _LARGE
        hardens = any(one in BUILT_IN and BUILT_IN[one].spring == "beside" for one in suspects)
        if self.data.axis.system is ROTARY and (hardens or is_large):
            others += [name for name, term in BUILT_IN.items() if term.spring == "instead"]
        if self.found.record_status & (Status.SCALES_DISAGREE | Status.ILL_CONDITIONED):
            others += [name for name, term in BUILT_IN.items() if not getattr(term, "inner", ())]
        present = {*suspects, *(one.name for one in self.terms)}
        return suspects + [name for name in dict.fromkeys(others) if name not in present]

    @property
    def _others(self) -> list[str]:
        """Terms that nothing suspects and that a first look may find."""
        present = {*self._suspects, *(one.name for one in self.terms)}
        may_be = (name for name, term in BUILT_IN.items() if term.is_sought and not term.inner and name not in present)
        return [name for name in may_be if self.data.axis.system is ROTARY or not BUILT_IN[name].angle_period]

    def _identify(self, data: Data, *, lag: Any, terms: Any, diagnose: bool = False, **given: Any) -> Identification:
        form = WeakForm(**{name: given.pop(name) for name in _LENGTHS if name in given})
        asked = {**given, "terms": terms, "lag": lag, "quantisation": self.request.quantisation}
        # An angle that turns is unwrapped by now.
        request = replace(resolve(form, asked, None, 1 / self.data.period), period=self.request.period)
        return self.run(request, replace(data, step=1, labels=None, doubts=()), diagnose=diagnose)
