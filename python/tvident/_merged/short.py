"""What trials or masses share, in one line, and as a table of HTML for notebooks."""

from __future__ import annotations

from typing import Any

import numpy as np

from tvident._results import samples_and_seconds

_MOST = 8
"""Elements of a line."""


def in_one_line(result: Any, whose: str) -> str:
    """Return the numbers of a result in one line."""
    values = [f"{name} {result.value(name)}" for name in list(result.elements)[:_MOST]]
    if len(result.elements) > _MOST:
        values.append(f"and {len(result.elements) - _MOST} more elements")
    return f"<MergedIdentification of {whose}, {samples_and_seconds(result)}: {'; '.join(values)}; {_part_trusted(result)}>"


def _part_trusted(result: Any) -> str:
    """Return how much of it can be trusted."""
    return f"{float(np.mean(result.trusted)):.1%} can be trusted" if result.status.size else "no samples"


def as_html(result: Any, whose: str) -> str:
    """Return a table of the elements, and below it what to do."""
    from html import escape  # noqa: PLC0415 - for notebooks alone

    each = {name: result.value(name) for name in result.elements}
    rows = [
        f"<tr><td>{escape(name)}</td><td>{escape(one.kind)}</td><td>{escape(str(one))}</td></tr>"
        for name, one in each.items()
    ]
    what = f"{whose}, {samples_and_seconds(result)}"
    lines = "".join(f"<li>{escape(line)}</li>" for line in result.advice)
    return (
        f"<p><b>MergedIdentification of {escape(what)}</b>, {escape(_part_trusted(result))}</p>"
        f"<table><tr><th>element</th><th>kind</th><th>value ± standard error</th></tr>{''.join(rows)}</table>"
        f"{f'<p>what to do</p><ul>{lines}</ul>' if lines else ''}"
    )
