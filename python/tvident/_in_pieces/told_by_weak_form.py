"""What the weak form says of stretches of a long record that was identified in strong form: where it contradicts, nobody is to believe."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tvident._equation import COEFFICIENTS
from tvident._identify import CONTRADICTED, Held, Long, Span, WeakForm, contradicted
from tvident._pieces import Columns, Given
from tvident._results import STAYS, Identification, Words
from tvident._status import DOUBTFUL, Status
from tvident._units import in_words_of

_STRETCH, _MOST = 1 << 14, 8
"""Samples of a stretch, as many as are tried of a record in memory, and how many there are at most."""

_LEAST = 30
"""Rows that tell a median."""

_CURE = "identify such a stretch in memory, and find out with scan() whether shorter windows agree"


def stretches_told(samples: int) -> list[Span]:
    """Return the stretches of a record that are identified in weak form, spread evenly."""
    count = min(max(samples // _STRETCH, 1), _MOST)
    firsts = np.linspace(0, max(0, samples - _STRETCH), count).astype(int).tolist()
    return [(first, min(first + _STRETCH, samples)) for first in firsts]


@dataclass(frozen=True)
class ToldByWeakForm:
    """A long record in strong form, of which stretches are identified in weak form.

    Parameters
    ----------
    long : Long
    given : Given
        What was asked of the record.
    read : callable
        Gives samples of some spans.
    rows : callable
        Gives the rows of a span of samples.
    begin : float
        Seconds of the first sample.
    units : mapping of str to str
        Of results.
    """

    long: Long
    given: Given
    read: Callable[[Sequence[Span]], Held]
    rows: Callable[[Span], Columns]
    begin: float
    units: Mapping[str, str]

    def advice(self, samples: int) -> list[str]:
        """Return what the weak form finds elsewhere, first, and what spoils polynomials, with the stretches that it is about."""
        spans = stretches_told(samples)
        count = len(spans)
        elsewhere: list[str] = []
        others: dict[str, list[float]] = {}
        for span in spans:
            held, begin = self.read([span]), self.begin + span[0] * self.given.period
            weak, seen = self._in_weak_form(held), self._seen(held)
            words = None if weak is None else contradicted(weak, self._found(span), begin, _CURE)
            if words is not None and weak is not None:
                elsewhere.append(words)
                seen += [line for line in weak.advice if line not in seen]
            for line in seen:
                others.setdefault(in_words_of(self.units, line), []).append(begin)
        if len(elsewhere) > 1:
            elsewhere = [f"{elsewhere[0]} (so in {len(elsewhere)} of {count} stretches)"]
        told = [in_words_of(self.units, line) for line in elsewhere]
        if count == 1:
            return [*told, *others]
        return told + [
            f"{line} (stretches at {', '.join(f'{time:.0f}' for time in times)} s)" for line, times in others.items()
        ]

    def _in_weak_form(self, held: Held) -> Identification | None:
        """Return what the weak form finds, where nothing contradicts it: what a recorder spoilt is left out there, and said."""
        given = replace(self.given, method=WeakForm(), equation=self.long.in_weak_form, settings=None)
        try:
            weak = given.identified(held, diagnose=True)
        except ValueError:
            return None  # nothing of it is there
        return None if weak.record_status & CONTRADICTED & ~Status.CHANNEL_SUSPECTED else weak

    def _seen(self, held: Held) -> list[str]:
        """Return what is seen in a stretch that spoils polynomials."""
        try:
            words = self.given.identified(held, diagnose=True)._words  # noqa: SLF001 - without what is tried
        except ValueError:
            return []
        return [line for line in (words if isinstance(words, Words) else words()).advice if STAYS in line]

    def _found(self, span: Span) -> dict[str, tuple[float, float]]:
        """Return what the strong form finds in a stretch, with errors of single samples."""
        columns = self.rows(span)
        found = {}
        good = columns["status"] & np.uint16(DOUBTFUL) == 0
        for name in COEFFICIENTS:
            values, errors = columns[name], columns[f"{name}_stderr"]
            there = good & np.isfinite(values) & np.isfinite(errors)
            if name not in self.long.known and np.count_nonzero(there) >= min(_LEAST, values.size) > 0:
                found[name] = float(np.median(values[there])), float(np.median(errors[there]))
        return found
