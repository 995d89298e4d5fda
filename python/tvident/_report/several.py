"""What one page says of several records that were identified together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tvident import _arguments as arguments
from tvident._report.content import ShownResult, content_of, title_of, unit_of
from tvident._report.packed import Series

_WORST_FIRST = ("bad", "doubtful", "good")

_MOST = 24
"""Records on one page: each has some ten plots."""

_SERIES = ("line", "second", "shade")
"""Of a plot, the numbers of its series; bands have two."""


@dataclass(frozen=True)
class ShownList:
    """Records that were identified together.

    Parameters
    ----------
    records : sequence of (ShownResult, list of Series)
        Each with its channels.
    shared : mapping of str to (float, float)
        What they share, with standard errors.
    advice : sequence of str
        About what is shared.
    summary : str
    """

    records: Sequence[tuple[ShownResult, list[Series]]]
    shared: Mapping[str, tuple[float, float]]
    advice: Sequence[str]
    summary: str


def check_count(records: int) -> None:
    """Refuse more records than a page shows."""
    if not 1 <= records <= _MOST:
        raise ValueError(f"a report shows 1 to {_MOST} records; got {records}; take some of them: result[:{_MOST}]")


def content_of_list(shown: ShownList, title: str) -> tuple[dict[str, Any], list[Series]]:
    """Return what a page says, plain JSON, and the series of its plots, record by record.

    Where they begin at different times the clock of each begins with it: what lies between them would be most of the plots.
    """
    parts: list[dict[str, Any]] = []
    series: list[Series] = []
    charts: list[dict[str, Any]] = []
    each = [content_of(record, recorded, title) for record, recorded in shown.records]
    begins = [content["span"][0] for content, _ in each]
    is_together = len(set(begins)) == 1
    for number, (content, drawn) in enumerate(each):
        charts += [_moved(chart, len(series), number) for chart in content["charts"]]
        series += [one if is_together else _from_zero(one, begins[number]) for one in drawn]
        parts.append(content)
    units = shown.records[0][0].result.units
    numbers = [
        {
            "name": title_of(name),
            "unit": unit_of(name, units),
            "value": arguments.with_error(value, error),
            "kind": f"shared by {_counted(len(parts))}",
            "more": "",
        }
        for name, (value, error) in shown.shared.items()
    ]
    common = {line["name"] for line in numbers}
    for number, one in enumerate(parts):
        own = [line for line in one["numbers"] if line["name"] not in common]
        numbers += [line | {"name": f"Record {number}: {line['name']}"} for line in own]
    lengths = [one["span"][1] - one["span"][0] for one in parts]
    first = begins[0] if is_together else 0.0
    clock = "" if is_together else "; times of the plots count from the beginning of each"
    worst = min((one["tone"] for one in parts), key=_WORST_FIRST.index)
    content = parts[0] | {
        "verdict": _verdict(parts, worst, shown.advice),
        "tone": "bad" if shown.advice else worst,
        "span": [first, first + max(lengths)],
        "facts": f"{_counted(len(parts))} of {_range(lengths)} s{clock}",
        "numbers": numbers,
        "advice": [*shown.advice, *_of_each(parts, "advice", _sentence)],
        "warnings": [
            _warning(number, one, 0.0 if is_together else begins[number])
            for number, part in enumerate(parts)
            for one in _warned(part)
        ],
        "jumps": [],
        "reasons": _of_each(parts, "reasons", _sentence),
        "settings": _of_each(parts, "settings", _setting),
        "repeat": "",
        "summary": shown.summary,
        "charts": charts,
    }
    return content, series


def _verdict(parts: Sequence[Mapping[str, Any]], worst: str, shared: Sequence[str]) -> str:
    """Return the verdict of the worst record, and how many are as bad; first what is wrong with what is shared, unless one explains it."""
    places = [place for place, one in enumerate(parts) if one["tone"] == worst]
    said = [] if worst == "bad" else [one.partition(": ")[0] for one in shared]
    if worst == "good":
        said.append(f"{_counted(len(parts))}, no reason to distrust any")
    else:
        which = f" ({arguments.listed([str(one) for one in places])})" if len(places) > 1 else ""
        word = "not to be trusted" if worst == "bad" else "to be looked at"
        said.append(f"{len(places)} of {_counted(len(parts))} {word}{which}")
    return "; ".join([*said, _sentence(places[0], parts[places[0]]["verdict"])])


def _counted(records: int) -> str:
    return "1 record" if records == 1 else f"{records} records"


def _range(lengths: Sequence[float]) -> str:
    """Return the least and the greatest, once where they are written alike."""
    return " to ".join(dict.fromkeys(f"{one:.4g}" for one in (min(lengths), max(lengths))))


def _of_each(parts: Sequence[Mapping[str, Any]], name: str, of_record: Callable[[int, Any], Any]) -> list[Any]:
    """Return what stands under a name, once where it is of all records, and else with the number of theirs."""
    every = [line for line in parts[0][name] if all(line in one[name] for one in parts)]
    own = [of_record(number, line) for number, one in enumerate(parts) for line in one[name] if line not in every]
    return [*every, *own]


def _sentence(number: int, line: str) -> str:
    return f"record {number}: {line}"


def _setting(number: int, row: list[str]) -> list[str]:
    return [f"Record {number}: {row[0]}", row[1]]


def _warned(part: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the warnings of a record, and that its parameters jump."""
    jumps = [[time, time] for time in part["jumps"]]
    words = "parameters jump; below it is said which"
    return [
        *part["warnings"],
        *([{"flag": "", "words": words, "where": "", "times": jumps, "more": 0}] if jumps else []),
    ]


def _warning(number: int, one: dict[str, Any], begin: float) -> dict[str, Any]:
    times = [[start - begin, end - begin] for start, end in one["times"]]
    return one | {"words": _sentence(number, one["words"]), "times": times}


def _moved(chart: dict[str, Any], by: int, number: int) -> dict[str, Any]:
    """Return a plot of a record, whose series come after those of other records."""
    moved = chart | {name: chart[name] + by for name in _SERIES if chart.get(name) is not None}
    if "band" in chart:
        moved["band"] = [one + by for one in chart["band"]]
    if "strips" in chart:
        moved["strips"] = [one | {"series": one["series"] + by} for one in chart["strips"]]
    return moved | {"group": f"Record {number}: {chart['group'].lower()}"}


def _from_zero(one: Series, begin: float) -> Series:
    return Series(one.name, one.unit, one.values, one.start - begin, one.period, one.is_recorded)
