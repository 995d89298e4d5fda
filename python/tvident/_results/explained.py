"""A result walked through: what was asked, found, tested and tried, one step after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tvident._results.verdict import verdict
from tvident._status import Status
from tvident._units import in_words_of


def explained_steps(result: Any) -> str:
    """Return what was done with a single record, in numbered steps, each with what it says about this record."""
    lines: list[str] = []
    for number, (title, sentences) in enumerate(_steps(result), 1):
        lines += ["", f"{number}. {title}", *(f"   {line}" for sentence in sentences for line in sentence.split("\n"))]
    return "\n".join(lines[1:])


def _steps(result: Any) -> Iterator[tuple[str, list[str]]]:
    s, n = result.settings, result.time.size
    seconds = float(result.time[-1] - result.time[0]) if n else 0.0
    terms = list(result.terms)
    equation = " + ".join(["I θ̈", "C θ̇", "K θ", *terms])
    yield (
        "What was asked",
        [
            f"{n} values over {seconds:.4g} s at {s['sample_rate']:.6g} Hz; the equation is {equation} = T",
            *_kinds(result),
        ],
    )
    yield "What was chosen from the record, and why", list(result.reasons) or ["nothing: everything was given"]
    scan = _scan(result)
    if scan:
        yield (
            "Do slow and fast motion agree? Estimates by the width of the test function, or by the length of windows (* agree)",
            [scan],
        )
    yield "Does the model hold where it was not fitted?", [in_words_of(result.units, result.held_back().words())]
    yield "How much can be trusted", [_flags(result), verdict(result)]
    yield "What to do next, most useful first", list(result.advice) or ["nothing: no test contradicts these numbers"]


def _scan(result: Any) -> str:
    """Return the estimates by the width of the test function; an empty string if there are none."""
    try:
        return str(result.scan().summary())
    except (ValueError, IndexError):
        return ""


def _kinds(result: Any) -> list[str]:
    words = {
        "known": "known: it was given",
        "constant": "one value for the record",
        "windowed": "one value at every sample, from the equations around it",
        "expanded": "a sum of functions: one value at every sample",
        "varying": "changes slowly: one value at every sample",
        "auto": "constant in some records, changing in others",
    }
    return [f"{name}: {result.value(name)}; {words[kind]}" for name, kind in result.settings["kinds"].items()]


def _flags(result: Any) -> str:
    share = float(np.mean(result.trusted)) if result.trusted.size else 0.0
    lines = [f"{share:.1%} of the samples can be trusted"]
    for flag in Status:
        here = float(np.mean(result.status & flag != 0)) if result.status.size else 0.0
        if here > 0:
            lines.append(f"{flag.name} at {here:.1%} of the samples: {in_words_of(result.units, flag.advice)}")
        if result.record_status & flag:
            lines.append(f"{flag.name} for the whole record: {in_words_of(result.units, flag.advice)}")
    return "\n".join(lines)
