"""What is judged of a long record, from what is kept of its stretches and rows: the verdict and all advice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tvident._advice import SWAPPED
from tvident._identify import Held, Span
from tvident._in_pieces.judged import JudgedRows
from tvident._in_pieces.swapped import asked_if_swapped
from tvident._in_pieces.told_by_weak_form import ToldByWeakForm
from tvident._pieces import Columns, Given
from tvident._status import Status


@dataclass(frozen=True)
class KeptStretches:
    """Parts of a recording that outlive its file.

    Parameters
    ----------
    held : mapping
        Samples of each.
    rows : mapping
        What was found there.
    """

    held: Mapping[Span, Held]
    rows: Mapping[Span, Columns]

    def read(self, spans: Sequence[Span]) -> Held:
        """Return the samples of the only one of some spans."""
        (span,) = spans
        return self.held[span]

    def found(self, span: Span) -> Columns:
        """Return the rows of a span of samples."""
        return self.rows[span]


@dataclass(frozen=True)
class Judging:
    """What is asked for a verdict, which takes the weak form half a second: like that on a recording in memory it waits for who reads it.

    Parameters
    ----------
    given : Given
        What was asked of the record.
    equation : mapping
        In weak form.
    kept : KeptStretches
    weak : ToldByWeakForm, optional
        What tells whether the weak form finds the same, of a record in strong form.
    rows : mapping of str to ndarray
        Rows that are spread over the result.
    samples : int
        Of the recording.
    status : Status
        Of the record.
    advice : sequence of str
        What pieces and choices said.
    settings : mapping
    units : mapping of str to str
    """

    given: Given
    equation: Mapping[str, Any]
    kept: KeptStretches
    weak: ToldByWeakForm | None
    rows: Columns
    samples: int
    status: Status
    advice: Sequence[str]
    settings: Mapping[str, Any]
    units: Mapping[str, str]

    def judged(self) -> tuple[str, tuple[str, ...]]:
        """Return the verdict and all advice."""
        advice = [*(self.weak.advice(self.samples) if self.weak is not None else ()), *self.advice]
        if not self.rows:
            return "no verdict: there are no rows", tuple(advice)
        judged = JudgedRows(self.rows, self.status, advice, self.settings, self.units)
        is_asked = judged.is_doubted and not any(SWAPPED in line for line in advice)
        judged = judged.with_cure(self._if_swapped() if is_asked else ())
        return judged.verdict(), tuple(judged.advice)

    def _if_swapped(self) -> list[str]:
        return asked_if_swapped(self.given, self.equation, self.kept.read, sorted(self.kept.held))
