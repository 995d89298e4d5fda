"""What a report says of a result: numbers, settings and warnings in plain words, and which series its plots show."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._choices import VERSION
from tvident._report.packed import Computed, Series
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD, Status, stretches_of
from tvident._units import in_words_of

Array: TypeAlias = npt.NDArray[np.float64]

_STRETCHES = 12
"""Times of a warning that are listed: the longest."""

_FEW = 0.0005
"""A share of samples below which their number says more."""

_SYMBOL = 2
"""Letters of a symbol at most."""

_COMMON_POWER = re.compile(r"\((.+) ± (.+)\)(e.+)")

_SYMBOLS = {"inertia": "Inertia I", "damping": "Damping C", "stiffness": "Stiffness K"}


class ReportedResult(Protocol):
    """What a report takes from every result."""

    time: Array
    constants: dict[str, tuple[Any, Any]]
    status: npt.NDArray[np.uint16]
    record_status: Status | npt.NDArray[np.uint16]
    jumps: tuple[Any, ...]
    settings: dict[str, Any]
    units: Mapping[str, str]

    @property
    def stderr(self) -> Mapping[str, Array]:
        """Standard errors by name."""

    @property
    def reasons(self) -> tuple[str, ...]:
        """What was chosen, and why."""

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do about what looks wrong."""

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        """Where values can be trusted."""


@dataclass(frozen=True)
class Curve:
    """What follows from parameters, at every sample of a result.

    Parameters
    ----------
    title, unit : str
    values, errors : ndarray, shape (n,)
    """

    title: str
    unit: str
    values: Array
    errors: Array


@dataclass(frozen=True)
class Compared:
    """A recorded torque and the one that was predicted.

    Parameters
    ----------
    title : str
        What it is called.
    recorded, predicted : ndarray, shape (m,)
    """

    title: str
    recorded: Array
    predicted: Array


@dataclass(frozen=True)
class ShownResult:
    """What a page shows of a result, where kinds of results differ.

    Parameters
    ----------
    result : ReportedResult
    values : mapping of str to ndarray, shape (n,)
        Parameters and terms by name.
    derived : callable
        Gives what follows from them, where something changes.
    quality : mapping of str to ndarray, shape (n,)
        Residuals, condition numbers and orders by name.
    settings : sequence of (str, str)
        As an engineer reads them.
    summary : callable
        Gives the result in words.
    compared : sequence of Compared
    remarks : mapping of str to str
        What is said beside a parameter.
    repeats : bool
        Whether the settings repeat the identification.
    said : callable
        Takes words and returns them as whoever asked for the page speaks: of options, where that was the command line.
    """

    result: ReportedResult
    values: Mapping[str, Array]
    derived: Callable[[], Sequence[Curve]]
    quality: Mapping[str, Array]
    settings: Sequence[tuple[str, str]]
    summary: Callable[[], str]
    compared: Sequence[Compared] = ()
    remarks: Mapping[str, str] = field(default_factory=dict)
    repeats: bool = True
    said: Callable[[str], str] = str


def unit_of(name: str, units: Mapping[str, str]) -> str:
    """Return a unit as it is printed."""
    unit = units.get(name, "")
    return "" if unit == "1" else unit.replace("^2", "²").replace("^3", "³").replace(" ", "·")


def content_of(shown: ShownResult, recorded: list[Series], title: str) -> tuple[dict[str, Any], list[Series]]:
    """Return what a page says, plain JSON, and the series of its plots; plots name them by number."""
    result = shown.result
    advice = list(map(shown.said, result.advice))
    # Both are passes over the whole record: the words take as long as what is drawn.
    with ThreadPoolExecutor(1) as beside:
        summary = beside.submit(shown.summary)
        drawn = _DrawnSeries(shown, list(recorded))
        drawn.recorded()
        drawn.found()
        for one in shown.compared:
            drawn.compared(one)
        drawn.quality()
        marks = _flags_over_time(result)
        drawn.status(marks)
        numbers = _numbers(shown)
        series, words = drawn.series, shown.said(summary.result())
    end = max([one.start + max(0, one.values.size - 1) * one.period for one in series], default=0.0)
    content = {
        "title": title,
        "verdict": words.splitlines()[0],
        "tone": _tone(result, words.splitlines()[0]),
        "span": [min([one.start for one in series], default=0.0), end],
        "numbers": numbers,
        "advice": advice,
        "warnings": [
            one | {"words": shown.said(in_words_of(result.units, one["words"]))} for one in _warnings(result, marks)
        ],
        "jumps": [round(float(time), 6) for time in result.jumps],
        "reasons": list(map(shown.said, result.reasons)),
        "settings": [list(row) for row in shown.settings],
        "repeat": json.dumps(result.settings, indent=1) if shown.repeats else "",
        "summary": words,
        "charts": drawn.charts,
        "version": VERSION,
    }
    return content, series


class _DrawnSeries:
    """Collects what is drawn: series, and plots that name them by number."""

    def __init__(self, shown: ShownResult, series: list[Series]) -> None:
        self.shown, self.result = shown, shown.result
        self.series = series
        self.charts: list[dict[str, Any]] = []
        result = self.result
        self.rate = float(result.settings["sample_rate"])
        self.start = float(result.time[0]) if result.time.size else 0.0
        flagged = result.status & np.uint16(_worth_a_look(result)) != 0
        self.shade: int | None = None
        self._flagged = flagged if flagged.any() else None

    def recorded(self) -> None:
        """Draw the channels."""
        for number, one in enumerate(self.series):
            self.charts.append({"group": "Recorded", "title": one.name, "unit": one.unit, "line": number})
        if self._flagged is not None:
            self.shade = self._add("flagged", "", self._flagged.view(np.uint8))

    def found(self) -> None:
        """Draw the time-varying parameters, with bands of two standard errors."""
        result, values = self.result, self.shown.values
        curves = [
            Curve(title_of(name), unit_of(name, result.units), found, result.stderr[name])
            for name, found in values.items()
            if name not in result.constants and _is_unknown(result, name)
        ]
        for one in [*curves, *self.shown.derived()] if curves else []:
            if not np.isfinite(one.values).any():
                continue
            band = [self._add(one.title, one.unit, _sum(one.values, one.errors, by)) for by in (-2, 2)]
            line = self._add(one.title, one.unit, one.values)
            self._draw("Found", one.title, one.unit, line=line, band=band, robust=True)

    def compared(self, one: Compared) -> None:
        """Draw the recorded torque, the predicted one, and what is left."""
        if not np.isfinite(one.predicted).any():
            return
        unit = unit_of("torque", self.result.units)
        left = _sum(one.recorded, one.predicted, -1)
        series: dict[str, Array | Computed] = {"recorded": one.recorded, "predicted": one.predicted, "left": left}
        numbers = [self._add(name, unit, values, every_sample=True) for name, values in series.items()]
        weak = self.result.settings["form"] == "weak"
        words = f"{one.title}, averaged over the test function" if weak else f"{one.title} and its prediction"
        self._draw("How well", words, unit, line=numbers[0], second=numbers[1], robust=True)
        self._draw("How well", f"{one.title} less what is predicted", unit, line=numbers[2], robust=True)

    def quality(self) -> None:
        """Draw residuals, condition and order where they change."""
        words = {
            "residual_std": "Residual, standard deviation",
            "condition": "Condition number of the equations",
            "order": "Order of the polynomial",
        }
        for name, values in self.shown.quality.items():
            numbers = np.asarray(values)
            if name == "condition" and (numbers == 0).any():
                numbers = np.where(numbers == 0, np.nan, numbers)  # where windows have no equations
            # Nothing is less or greater where there is no number.
            if numbers.size and np.fmin.reduce(numbers) < np.fmax.reduce(numbers):
                unit = unit_of(name, self.result.units)
                self._draw("How well", words[name], unit, line=self._add(name, unit, numbers), robust=name != "order")

    def status(self, marks: Mapping[Status, npt.NDArray[np.bool_]]) -> None:
        """Draw where each flag is set."""
        strips = [
            {"flag": flag.name, "series": self._add(str(flag.name), "", mark.view(np.uint8))}
            for flag, mark in marks.items()
        ]
        if strips:
            self.charts.append({"group": "How well", "title": "Status over time", "unit": "", "strips": strips})

    def _add(self, name: str, unit: str, values: npt.NDArray[Any] | Computed, *, every_sample: bool = False) -> int:
        period = (1 if every_sample else int(self.result.settings["step"])) / self.rate
        # What the strong form compares is the torque as it was recorded: a plot may show what another one does.
        for number, one in enumerate(self.series):
            if one.values is values and (one.start, one.period) == (self.start, period):
                return number
        self.series.append(Series(name, unit, values, self.start, period))
        return len(self.series) - 1

    def _draw(self, group: str, title: str, unit: str, **what: Any) -> None:
        self.charts.append({"group": group, "title": title, "unit": unit, "shade": self.shade} | what)


def _sum(values: Array, others: Array, times: float) -> Computed:
    """Return values and so many times others beside them."""
    return Computed(values.size, lambda some: values[some] + times * others[some])


def title_of(name: str) -> str:
    """Return what a parameter is called over its plot."""
    plain = name.replace("_", " ")
    # Symbols are as they were given: a factor is h or I2.
    return _SYMBOLS.get(name, plain if len(plain.split()[0]) <= _SYMBOL else plain.capitalize())


def _is_unknown(result: ReportedResult, name: str) -> bool:
    return str(result.settings["kinds"].get(name)) != "known"


def _numbers(shown: ShownResult) -> list[dict[str, str]]:
    """Return a line for every parameter: its value and error, or its range."""
    result, values = shown.result, shown.values
    lines = []
    for name, found in values.items():
        kind = str(result.settings["kinds"].get(name, ""))
        line = {
            "name": title_of(name),
            "unit": unit_of(name, result.units),
            "kind": kind,
            "more": shown.remarks.get(name, ""),
        }
        if name in result.constants:
            line["value"] = _apart(*map(float, result.constants[name]))
            line["kind"] = "constant over the record"
            lines.append(line)
            continue
        there, error = (arguments.finite(one) for one in (found, result.stderr[name]))
        if not there.size:
            line["value"] = "no value"
        elif kind == "known" and there.min() == there.max():
            line |= {"value": f"{there[0]:.5g}", "kind": "known: as given"}
        else:
            low, middle, high = arguments.percentiles(there, 5, 50, 95)
            (typical,) = arguments.percentiles(error, 50)
            line["value"] = _apart(middle, typical)
            ends = " and ".join(arguments.to_digits_of(one, typical) for one in (low, high))
            line["more"] = "; ".join(filter(None, (f"90 % lie between {ends}", line["more"])))
            line["kind"] = "known: as given" if kind == "known" else f"{kind}: the median of its values"
        lines.append(line)
    for name in [one for one in result.constants if one not in values]:
        # The angle zero, and what was searched inside of terms.
        value = _apart(*map(float, result.constants[name]))
        words = {"name": title_of(name.replace(".", " ")), "unit": unit_of(name, result.units), "more": ""}
        lines.append(words | {"value": value, "kind": "constant over the record"})
    return lines


def _apart(value: float, error: float) -> str:
    """Return a value and its error, each of which can stand alone: the page shows one larger than the other."""
    return _COMMON_POWER.sub(r"\1\3 ± \2\3", arguments.with_error(value, error))


def _everywhere(result: ReportedResult) -> Status:
    """Return the flags that all samples have: they are said once, and shade nothing."""
    return Status(int(np.bitwise_and.reduce(result.status)) if result.status.size else 0)


def _worth_a_look(result: ReportedResult) -> int:
    return int((DOUBTFUL | Status.GAP) & ~(_everywhere(result) | Status(int(result.record_status))))


def _flags_over_time(result: ReportedResult) -> dict[Status, npt.NDArray[np.bool_]]:
    """Return where each flag is set, for flags that are set somewhere."""
    occurring = int(np.bitwise_or.reduce(result.status)) if result.status.size else 0
    # NumPy takes a flag for a number of 64 bits.
    return {flag: result.status & np.uint16(flag) != 0 for flag in Status if occurring & flag}


def _warnings(result: ReportedResult, marks: Mapping[Status, npt.NDArray[np.bool_]]) -> list[dict[str, Any]]:
    """Return what is flagged, in words, with its share and the times of its longest stretches."""
    warnings: list[dict[str, Any]] = [
        {"flag": flag.name, "words": flag.advice, "where": "the whole record", "times": [], "more": 0}
        for flag in Status
        if int(result.record_status) & flag
    ]
    for flag, mark in marks.items():
        if int(result.record_status) & flag and mark.all():
            continue  # said already
        first, end = stretches_of(mark)
        longest = np.sort(np.argsort(first - end, kind="stable")[:_STRETCHES])
        times = [[float(result.time[first[one]]), float(result.time[end[one] - 1])] for one in longest]
        share = float(mark.mean())
        where = f"{100 * share:.1f} % of the samples" if share >= _FEW else f"{int(mark.sum())} samples"
        warnings.append(
            {"flag": flag.name, "words": flag.advice, "where": where, "times": times, "more": first.size - longest.size}
        )
    return warnings


def _tone(result: ReportedResult, verdict: str) -> str:
    """Return whether all is well, something deserves a look, or nothing is to be trusted: never better than the verdict."""
    if (
        verdict.startswith("do not trust")
        or int(result.record_status) & int(DOUBTFUL_RECORD)
        or not result.trusted.any()
    ):
        return "bad"
    return "doubtful" if result.advice or int(result.record_status) else "good"
