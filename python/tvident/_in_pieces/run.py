"""One call from file to file: choices, pieces, what they say together, the output."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tvident import _core
from tvident._equation import LINEAR_UNITS, UNITS
from tvident._files import errors_name, put_in_place
from tvident._identify import Long, Span, WeakForm, requested
from tvident._in_pieces.behind import Behind
from tvident._in_pieces.choices import chosen, stretches
from tvident._in_pieces.found import FileIdentification
from tvident._in_pieces.judging import Judging, KeptStretches
from tvident._in_pieces.kept import Kept
from tvident._in_pieces.outputs import CHUNK, OutputTable, head_of_rows, holds_facts, holds_rows, writer
from tvident._in_pieces.recorded import RecordingOfFile
from tvident._in_pieces.rows import row_of
from tvident._in_pieces.swapped import asked_if_swapped, stretches_asked
from tvident._in_pieces.told_by_weak_form import ToldByWeakForm, stretches_told
from tvident._in_pieces.work import Alone, WindowsWork, Work
from tvident._pieces import SHARED, Columns, Given, Mean, means_of, reach_of
from tvident._status import Status
from tvident._units import ROTARY

_SPREAD = 64
"""Stretches of rows that are judged, and rows of each."""


class AskedOfFile:
    """What is asked for of a recording.

    Parameters
    ----------
    recording : RecordingOfFile
    given : Given
    step : int
        Every how many samples a row is wanted.

    Attributes
    ----------
    long : Long, optional
        The record, in strong form.
    is_narrow : bool
        Whether equations are of the weak form, with one unknown at most that changes: rows of others hold several times as many numbers.
    """

    def __init__(self, recording: RecordingOfFile, given: Given, step: int) -> None:
        self.recording, self.given, self.step = recording, given, step
        rate = 1 / recording.period
        request = requested(given.method, given.equation, given.settings, rate)
        self.long: Long | None = None
        changing = {"windowed", "varying"}
        pairs = (term for term in request.terms if isinstance(term, tuple | list))
        kinds = [*request.parameters.values(), *(kind for pair in pairs for kind in pair[1:])]
        self.is_narrow = isinstance(request.form, WeakForm) and sum(str(kind) in changing for kind in kinds) <= 1
        if isinstance(request.form, WeakForm):
            return
        if request.quantisation is None:
            spans = _core.parts_of_quantisation(recording.samples)
            held = recording.held(spans)
            found = _core.quantisation_step(held.angle, parts=spans, of=recording.samples)
            self.given = replace(given, equation={**given.equation, "quantisation": found})
            request = requested(given.method, self.given.equation, given.settings, rate)
        self.long = Long(
            request,
            recording.samples,
            recording.period,
            recording.axis,
            propagate=given.nan_policy == "propagate",
            step=step,
            weighted=given.weighted,
        )

    @property
    def units(self) -> Mapping[str, str]:
        """Units of results."""
        return UNITS if self.recording.axis.system is ROTARY else LINEAR_UNITS

    def borders(self, piece: int) -> list[int]:
        """Return where pieces of about so many samples begin, and where the last ends: neighbours are at most a quarter of them."""
        samples, reach = self.recording.samples, 0
        if self.long is not None:
            first, end = self.long.around((samples, samples))
            reach = end - first
        count = max(1, round(samples / max(piece, 4 * reach)))
        return [samples * place // count for place in range(count + 1)]

    def in_pieces(self, choices: Mapping[str, Any] | None) -> Alone:
        """Return the work on pieces that are records of their own, with what was chosen for all of them."""
        settings = choices if choices is not None else self.long.settings() if self.long is not None else None
        reach = 0 if settings is None else reach_of(settings)
        identified = partial(self.given.identified, chosen=choices, step=self.step)
        return Alone(self.recording, identified, reach, self.step)


class Run:
    """One call: what is done is kept, and not done again.

    Parameters
    ----------
    asked : AskedOfFile
    kept : Kept
    piece : int
        Samples of a piece, about.
    output : Path
    report : callable, optional
    """

    def __init__(self, asked: AskedOfFile, kept: Kept, piece: int, output: Path, report: Any) -> None:
        self._asked, self._kept, self._output, self._report = asked, kept, output, report
        self._pieces: list[Span] = list(pairwise(asked.borders(piece)))
        self._samples = asked.recording.samples

    def all(self) -> FileIdentification:
        """Do all that is not done yet."""
        settings, work = self._prepared()
        # Of other work nothing stays while the next piece is worked on, which takes several times the memory.
        with Behind(is_apart=work.is_final) as behind:
            for piece in self._pieces[len(self._kept.notes) :]:
                behind.do(self._keeping(work, piece))
                if self._report is not None:
                    self._report(piece[1], self._samples)
        self._asked.recording.check_unchanged()
        if self._report is not None:
            # While no other call may write: what is told may ask for one.
            self._report.finish()
        return self._written(settings, work)

    def _keeping(self, work: Work, piece: Span) -> Callable[[], None]:
        """Return what keeps what is found of a piece, in a file that only needs its name where nothing changes any more."""
        columns, note = work.piece(piece, self._progress(piece))
        rows = -(-self._samples // self._asked.step)
        is_result = work.is_final and holds_rows(self._output)
        head = head_of_rows(row_of(columns), rows) if is_result else None
        if piece == self._pieces[0]:
            with errors_name(self._output):
                self._kept.begin(columns, rows, head)

        def keep() -> None:
            with errors_name(self._output):
                self._kept.add(columns, note, head)

        return keep

    def _progress(self, piece: Span) -> Any:
        """Return what is told of the work within a piece."""
        report, samples = self._report, self._samples
        if report is None:
            return None
        first, length = piece[0], piece[1] - piece[0]
        return lambda done, total: report(first + length * done // max(total, 1), samples)

    def _prepared(self) -> tuple[dict[str, Any] | None, Work]:
        """Return the settings, None where the only piece has its own, and the work on a piece."""
        asked, long = self._asked, self._asked.long
        if long is not None and long.is_windowed:
            if "factors" not in self._kept.facts:
                held = asked.recording.held(long.spans_of_scatter())
                self._kept.note_fact("factors", long.factors(held, asked.given.workers))
            alone = asked.in_pieces(None) if asked.given.nan_policy == "raise" else None
            factors = self._kept.facts["factors"]
            return long.settings(factors), WindowsWork(
                asked.recording, long, factors, alone, asked.step, asked.given.workers
            )
        if long is not None:
            return long.settings(), asked.in_pieces(None)
        if len(self._pieces) == 1:
            return None, asked.in_pieces(None)
        if "settings" not in self._kept.facts:
            self._choose()
        settings = dict(self._kept.facts["settings"])
        return settings, asked.in_pieces(settings)

    def _choose(self) -> None:
        """Take the settings of an earlier result, or choose from stretches of the recording."""
        asked = self._asked
        if asked.given.frozen is not None:
            self._kept.note_fact("settings", dict(asked.given.frozen))
            return
        spans = stretches(self._samples, asked.step)
        try:
            choices = chosen(spans, asked.recording.held, asked.given.identified, asked.recording.period)
        except ValueError as error:
            raise ValueError("; ".join([str(error), *self._asked_if_swapped()])) from None
        self._kept.note_fact("advice", choices.advice)
        self._kept.note_fact("record_status", choices.record_status)
        self._kept.note_fact("settings", choices.settings)

    def _written(self, settings: dict[str, Any] | None, work: Work) -> FileIdentification:
        """Write the output, now that all pieces are known."""
        notes, facts = self._kept.notes, self._kept.facts
        means = means_of([note for note in notes if note is not None])
        status = Status(int(facts.get("record_status", 0)))
        for note in notes:
            status |= Status(int(note["record_status"]) if note else 0)
        advice = self._contradictions(means)
        if advice:
            status |= Status.KIND_CONTRADICTED
        advice += facts.get("advice", [])
        if settings is None:
            settings = notes[0]["settings"]
            advice += notes[0]["advice"]
        constants = {name: (mean.value, mean.error) for name, mean in means.items()}
        judging = self._judging(work, means, status, advice, settings)
        if holds_facts(self._output):
            verdict, said = judging.judged()
            judge: Any = partial(tuple, (verdict, said))
            told = {"settings": settings, "constants": constants, "record_status": int(status), "advice": list(said)}
            self._put_in_place(work, means, {**told, "verdict": verdict})
        else:
            judge = judging.judged
            self._put_in_place(work, means, {})
        flags, rows = self._kept.flags, self._kept.count
        self._kept.remove()
        return FileIdentification(
            self._output,
            self._samples,
            rows,
            constants,
            status,
            flags,
            settings,
            self._asked.units,
            self._asked.recording.assumed,
            judge,
        )

    def _judging(
        self, work: Work, means: Mapping[str, Mean], status: Status, advice: Sequence[str], settings: Mapping[str, Any]
    ) -> Judging:
        """Return what a verdict is made from, with all that is needed of the files."""
        asked, long, step = self._asked, self._asked.long, self._asked.step
        is_told = long is not None and not asked.given.weighted
        spans = stretches_told(self._samples)
        spans = [] if asked.given.weighted else spans if is_told else list(stretches_asked(spans))
        held = {span: asked.recording.held([span]) for span in spans}
        found = {span: self._rows(work, means, (-(-span[0] // step), -(-span[1] // step))) for span in spans if is_told}
        kept = KeptStretches(held, found)
        equation = asked.given.equation if long is None else long.in_weak_form
        weak = None
        if long is not None and is_told:
            weak = ToldByWeakForm(long, asked.given, kept.read, kept.found, asked.recording.begin, asked.units)
        rows = self._some_rows(work, means) if self._kept.count else {}
        return Judging(asked.given, equation, kept, weak, rows, self._samples, status, advice, settings, asked.units)

    def _asked_if_swapped(self) -> list[str]:
        asked = self._asked
        return asked_if_swapped(asked.given, asked.given.equation, asked.recording.held, stretches_told(self._samples))

    def _some_rows(self, work: Work, means: Mapping[str, Mean]) -> Columns:
        """Return rows that are spread over the result."""
        count = self._kept.count
        firsts = range(0, count, max(_SPREAD, -(-count // _SPREAD)))
        each = [self._rows(work, means, (first, min(first + _SPREAD, count))) for first in firsts]
        return {name: np.concatenate([one[name] for one in each]) for name in each[0]} if each else {}

    def _rows(self, work: Work, means: Mapping[str, Mean], span: Span) -> Columns:
        """Return some rows as they are written, whichever pieces they are of."""
        found: list[Columns] = []
        for note, (first, last) in zip(self._kept.notes, self._rows_of_pieces(), strict=True):
            begin, end = max(span[0], first), min(span[1], last)
            if begin < end:
                found.append(self._finished(work, note, (begin, end), means))
        return {name: np.concatenate([one[name] for one in found]) for name in found[0]} if found else {}

    def _rows_of_pieces(self) -> list[Span]:
        """Return which rows are those of each piece."""
        step, done, found = self._asked.step, 0, []
        for first, end in self._pieces:
            last = done + len(range(first + -first % step, end, step))
            found.append((done, last))
            done = last
        return found

    def _put_in_place(self, work: Work, means: Mapping[str, Mean], told: Mapping[str, Any]) -> None:
        """Write all columns to where the result is to be."""
        if work.is_final and holds_rows(self._output) and put_in_place(self._kept.place, self._output):
            return
        notes = self._kept.notes
        some = self._finished(work, notes[0], (0, min(1, self._kept.count)), means)
        kinds = {name: values.dtype for name, values in some.items()}
        with writer(self._output, OutputTable(kinds, self._kept.count, self._asked.units, told)) as put:
            for note, (first, last) in zip(notes, self._rows_of_pieces(), strict=True):
                for begin in range(first, last, CHUNK):
                    put(self._finished(work, note, (begin, min(begin + CHUNK, last)), means))

    def _contradictions(self, means: Mapping[str, Mean]) -> list[str]:
        """Return what is to be said of constants that are none."""
        length = self._pieces[0][1] - self._pieces[0][0]
        return [
            f"{name} differs between pieces of {length} samples by {mean.spread:.1f} times what its errors say: every piece keeps its own; "
            f"give {name}='varying' where it changes, or identify parts of the recording"
            for name, mean in means.items()
            if not mean.agree
        ]

    def _finished(self, work: Work, note: Any, span: Span, means: Mapping[str, Mean]) -> Columns:
        """Return some rows as they are written."""
        columns = self._kept.columns(*span)
        if note is not None:
            return work.finished(columns, note, means)
        return {name: values for name, values in columns.items() if not name.startswith(SHARED)}
