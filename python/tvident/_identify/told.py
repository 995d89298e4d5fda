"""What an identification says of itself in words, and what it doubts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tvident import _core
from tvident._advice import (
    Explained,
    ExplainedStrong,
    FoundBySearch,
    Plausible,
    changes_of_gain,
    events_that_stay,
    fed_back_in_records,
    without_numbers,
    words_of_search,
    words_with_instrument,
)
from tvident._arguments import finite, percentiles, told_once
from tvident._clocks import holds_that_stay
from tvident._equation import COEFFICIENTS, Unknown
from tvident._identify.data import Data
from tvident._identify.improved import is_doubted
from tvident._identify.lacking import Lacking
from tvident._identify.methods import StrongForm
from tvident._identify.settings import Request
from tvident._results import Estimates, Words, of_batch
from tvident._status import Status


@dataclass(frozen=True)
class Told:
    """What was found in some records.

    Parameters
    ----------
    data : Data
    request : Request
    unknowns : sequence of Unknown
        Those of the equation, without what a search found.
    found : sequence of _core.Identification
    batch : Estimates
    lacking : sequence of Lacking or None
        The term that every record in strong form lacks.
    """

    data: Data
    request: Request
    unknowns: Sequence[Unknown]
    found: Sequence[_core.Identification]
    batch: Estimates
    lacking: Sequence[Lacking | None] = ()

    @np.errstate(all="ignore")
    def words(
        self, names: Sequence[str], searched: Sequence[Sequence[FoundBySearch]], settings: Mapping[str, Any]
    ) -> Words:
        """Return reasons and advice; of several records the advice, since reasons differ too much from one to the next.

        Saying it takes as long as identifying a short record, so it waits until somebody asks.

        Parameters
        ----------
        names : sequence of str
            What the core's unknowns are called.
        searched : sequence of sequence
            Inner parameters of every record.
        settings : mapping
            Of the result.
        """
        data, several = self.data, bool(self.data.batch)
        plausible = Plausible(data.axis, data.period, [one.name for one in self.unknowns], self.request.period)
        more = [words_of_search(terms) for terms in searched]
        if isinstance(self.request.form, StrongForm) and data.instruments is None:
            words = self._of_strong_form(settings).words()
            words = replace(words + (of_batch(more) if several else more[0]), each=words.each)
            words = plausible.before(words, data.angles, self.batch)
            if several and not words.each:
                words = replace(words, each=tuple(Words(words.reasons, words.advice) for _ in self.found))
            doubts = [*holds_that_stay(data.angles), *events_that_stay(data.angles, data.torques)]
            if not data.motion.recorded:
                # What was made of several channels, or integrated, has no noise above the motion that would be the angle's alone.
                doubts = [
                    *doubts,
                    *fed_back_in_records(data.angles, data.torques, self._inertias(), self._lags(settings)),
                ]
            words = _with_doubts(words, doubts, several=several)
        else:
            each = [one + search for one, search in zip(self._of_records(names, settings), more, strict=True)]
            words = plausible.before(of_batch(each) if several else each[0], data.angles, self.batch)
            words = replace(words, advice=(*words.advice, *self._where_remedies_are_tried()))
        if data.clock is not None:
            words = replace(words, reasons=(data.clock.words, *words.reasons))
        words = replace(words, reasons=(*data.said, *words.reasons))
        terms = [one.name for one in self.unknowns if one.name not in COEFFICIENTS]
        lacking = [
            (record, one.words(terms, data.units.get(one.name, ""))) for record, one in enumerate(self.lacking) if one
        ]
        empty = [*self._empty(), *self._without_room_to_change()]
        return _with_doubts(
            _with_clipped(words, data.clipped, several=several), [*empty, *data.doubts, *lacking], several=several
        )

    def _empty(self) -> list[tuple[int, str]]:
        """Return which channels hold nothing, of records without any value."""
        status = self.batch.status.reshape(-1, self.batch.status.shape[-1])
        empty = np.flatnonzero((status & Status.INVALID != 0).all(axis=1))
        return without_numbers(self.data.angles, self.data.torques, empty.tolist())

    def _without_room_to_change(self) -> list[tuple[int, str]]:
        """Return records whose windows are all there is of them, though something was to change: one length is not looked for."""
        form = self.request.form
        if isinstance(form, StrongForm) or form.averaging or form.regression_window != "auto":
            return []
        words = (
            "windows are as long as the record, in which nothing can change: their length is chosen where windows of many are "
            "averaged; give regression_window=, such as '0.2 s', or ask for averaging"
        )
        return [
            (record, words)
            for record, one in enumerate(self.found)
            if any(unknown.kind == "windowed" for unknown in one.unknowns)
            and not one.record_status & Status.RANK_DEFICIENT
        ]

    def _where_remedies_are_tried(self) -> list[str]:
        """Return where to look for remedies of the records of a batch, which are tried when a record is asked for its words."""
        flags = np.ravel(self.batch.record_status)
        if not self.data.batch or self.data.instruments is not None or not any(map(is_doubted, flags.tolist())):
            return []
        first = next(place for place, one in enumerate(flags.tolist()) if is_doubted(one))
        index = ", ".join(map(str, np.unravel_index(first, self.data.batch)))
        return [f"result[{index}].summary() tries what would explain record {first}; so do those of other records"]

    def doubted(self) -> Estimates:
        """Return the estimates, flagged where a channel leaves something open."""
        data = self.data
        flags = np.zeros(data.records, np.uint16)
        flags[[record for record, _ in data.doubts]] = Status.CHANNEL_SUSPECTED
        flags[[record for record, words in enumerate(self._of_gains) if words]] = Status.CHANNEL_SUSPECTED
        lacking = [record for record, term in enumerate(self.lacking) if term is not None]
        flags[lacking] |= np.uint16(Status.TERM_SUSPECTED)
        if not flags.any():
            return self.batch
        more: Any = flags.reshape(data.batch) if data.batch else Status(int(flags[0]))
        return replace(self.batch, record_status=self.batch.record_status | more)

    @cached_property
    def _of_gains(self) -> list[list[str]]:
        """That the gain of a channel seems to change, in words, by record."""
        if isinstance(self.request.form, StrongForm) or self.data.instruments is not None:
            return [[] for _ in self.found]
        names = [one.name for one in self.unknowns]
        return [changes_of_gain(one, names, self.data.period, self.data.step) for one in self.found]

    def _of_records(self, names: Sequence[str], settings: Mapping[str, Any]) -> list[Words]:
        """Return what there is to say of each record in weak form, or with an instrument."""
        data = self.data
        if data.instruments is not None:
            return [words_with_instrument(one, [unknown.name for unknown in self.unknowns]) for one in self.found]
        tested = [one.name for one in self.unknowns if one.kind == "auto" or one.name in self.request.tested]
        variances = [one.noise.angle if one.noise else 0.0 for one in self.found]
        # What was made of several channels, or integrated, has no noise above the motion that would be the angle's alone.
        coherences: Sequence[float | None] = [None] * len(variances)
        lags = self._lags(settings)
        if not data.motion.recorded:
            if data.weights is not None:
                variances = [one * spread for one, spread in zip(variances, data.weights.spread, strict=True)]
            coherences = _core.noise_coherence(data.angles, data.torques, variances, self._inertias(), lags)
        chosen = [name for name in settings["chosen"] if not self.request.is_kept(name)]
        return [
            Explained(
                one,
                names,
                chosen,
                tested,
                data.period,
                data.step,
                coherence,
                late,
                gains,
                data.units,
                data.motion.names[0],
            ).words()
            for one, coherence, late, gains in zip(self.found, coherences, lags, self._of_gains, strict=True)
        ]

    def _lags(self, settings: Mapping[str, Any]) -> list[float]:
        """Return the lag of every torque in samples, as it was given or found."""
        lags: list[float] = np.broadcast_to(np.divide(settings["lag"], self.data.period), self.data.records).tolist()
        return lags

    def _inertias(self) -> list[float]:
        """Return the usual inertia of every record over the square of the sample period; 0 where none was found."""
        found = self.batch.values["inertia"].reshape(self.data.records, -1)
        medians = [percentiles(finite(told_once(one)), 50)[0] / self.data.period**2 for one in found]
        return [0.0 if np.isnan(one) else one for one in medians]

    def _of_strong_form(self, settings: Mapping[str, Any]) -> ExplainedStrong:
        mask, step = self.data.mask, self.data.step
        names = [one.name for one in self.unknowns]
        return ExplainedStrong(
            found=self.batch,
            kinds={name: settings["kinds"][name] for name in names},
            untested=[name for place, name in enumerate(names) if self.found[0].unknowns[place].untested],
            settings=settings,
            mask=None if mask is None else mask[..., ::step],
        )


def _with_clipped(words: Words, clipped: Sequence[float] | None, *, several: bool) -> Words:
    """Return words that say how much of the torque is not as it was recorded."""
    if not any(clipped or ()):
        return words
    lines = [
        f"{f'record {record}: ' if several else ''}Huber's loss: {share:.2g} of the torque's samples differ from what the equation "
        "predicts by more than 2.5 standard deviations, and count linearly"
        for record, share in enumerate(clipped or ())
        if share
    ]
    return Words((*words.reasons, *lines), words.advice, words.each)


def _with_doubts(words: Words, doubts: Sequence[tuple[int, str]], *, several: bool) -> Words:
    """Return words that begin with what cannot be known of the channels."""
    if not doubts:
        return words
    lines = [f"record {record}: {line}" if several else line for record, line in doubts]
    each = list(words.each)
    for record, line in doubts if each else ():
        each[record] = replace(each[record], advice=(line, *each[record].advice))
    return Words(words.reasons, (*lines, *words.advice), tuple(each))
