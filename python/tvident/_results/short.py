"""A result in one line, and as a table of HTML for notebooks."""

from __future__ import annotations

from typing import Any

import numpy as np

from tvident._results.verdict import distrusted_at_once, unflagged
from tvident._status import describe
from tvident._units import in_words_of

_RECORDS = 3
"""Of a batch that are shown."""


def short(result: Any) -> str:
    """Return the numbers of a result in one line."""
    batch, what = result.inertia.shape[:-1], samples_and_seconds(result)
    if batch:
        kinds = ", ".join(f"{name} {kind}" for name, kind in result.settings["kinds"].items())
        return f"<Identification of {' x '.join(map(str, batch))} records of {what}: {kinds}; {part_trusted(result)}>"
    values = (f"{name} {result.value(name)}" for name in result.settings["kinds"])
    return f"<Identification of {what}: {'; '.join(values)}; {part_trusted(result)}>"


def samples_and_seconds(result: Any) -> str:
    """Return how much was recorded."""
    seconds = float(result.time[-1] - result.time[0]) if result.time.size else 0.0
    return f"{result.time.size} samples, {seconds:.4g} s"


def part_trusted(result: Any) -> str:
    """Return how much of it can be trusted, as far as that is known: what is shown by itself waits for no trial.

    Before anybody asked for the verdict it is how much has no flag that forbids that, and where to ask.
    """
    if not result.status.size:
        return "no samples"
    reasons = result._distrusted_by_now  # noqa: SLF001 - of results
    is_single = result.inertia.ndim == 1
    whole = result._whole or result  # noqa: SLF001 - likewise
    reason = distrusted_at_once(whole) if reasons is None and is_single else None
    if reasons is None and reason is None:
        return f"{float(np.mean(unflagged(result))):.1%} unflagged, summary() has the verdict"
    share = 0.0 if reason else float(np.mean(result.trusted))
    reason = reasons[0] if reasons and is_single else reason
    return f"{share:.1%} can be trusted{f': {reason}' if reason else ''}"


def _index(record: int, batch: tuple[int, ...]) -> str:
    """Return the index of a record in the batch, as it is typed."""
    return ", ".join(str(int(place)) for place in np.unravel_index(record, batch))


def as_html(result: Any) -> str:
    """Return a table of the parameters, and below it what to do."""
    from html import escape  # noqa: PLC0415 - for notebooks alone

    batch = result.inertia.shape[:-1]
    records = int(np.prod(batch, dtype=int))
    several = result.inertia.ndim > 1
    parts = [f"<p><b>{escape(short(result)[1:-1].partition(':')[0])}</b>, {escape(part_trusted(result))}</p>"]
    for record in range(min(records, _RECORDS)):
        rows = []
        for name in result.settings["kinds"]:
            one = result.value(name, record if several else None)
            words = escape(str(one))
            rows.append(f"<tr><td>{escape(name)}</td><td>{escape(one.kind)}</td><td>{words}</td></tr>")
        head = f"<caption>record {_index(record, batch)}</caption>" if several else ""
        parts.append(
            f"<table>{head}<tr><th>parameter</th><th>kind</th><th>value ± standard error</th></tr>{''.join(rows)}</table>"
        )
    if records > _RECORDS:
        parts.append(f"<p>and {records - _RECORDS} more records: result[{_index(_RECORDS, batch)}]</p>")
    if not result._is_told:  # noqa: SLF001 - of results
        parts.append("<p>result.summary() says what to do: it tries what would explain more, once</p>")
    elif result.advice:
        parts.append(f"<p>what to do</p><ul>{''.join(f'<li>{escape(line)}</li>' for line in result.advice)}</ul>")
    described = (in_words_of(result.units, line.strip()) for line in describe(result.status, result.record_status))
    flags = "".join(f"<li>{escape(line)}</li>" for line in described)
    return f"{''.join(parts)}<ul>{flags}</ul>"
