"""The summary of a result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments import finite, own_digits, percentiles, to_digits_of, told_once
from tvident._files import aligned
from tvident._results.verdict import CHANGING, verdict
from tvident._status import describe
from tvident._units import in_words_of

COLUMNS = ("kind", "median", "5 %", "95 %", "std. error", "unit")
"""Of the table, beside the name."""

_MOST_SENTENCES = 20
"""A summary of many records shows the advice for some."""


def _range(value: Any) -> str:
    """Return one number, or those of several records; words stand where nothing was chosen."""
    if not isinstance(value, list):
        return str(value)
    numbers = [one for one in value if not isinstance(one, str)]
    if not numbers:
        return str(value[0]) if value else "0"
    least, most = min(numbers), max(numbers)
    return str(least) if least == most else f"{least} to {most}"


@np.errstate(all="ignore")
def summary_of(result: Any, share: float | None = None) -> str:
    """Return what :meth:`tvident.Identification.summary` does; `share` of the torque that is explained, where that is known already."""
    s = result.settings
    n, seconds = result.time.size, float(result.time[-1] - result.time[0]) if result.time.size else 0.0
    length, rows = (_range(s[name]) for name in ("window_length", "regression_window"))
    if s["form"] == "strong":
        form = f"strong form: windows of {length} samples, orders up to {s['max_order']} by {s['criterion']}"
    else:
        form = f"weak form: test functions of {length} samples, exponent {_range(s['exponent'])}"
    lines = [
        verdict(result, share),
        in_words_of(result.units, result.held_back().words()),
        "",
        *aligned([("parameter", *COLUMNS), *_rows(result)]),
    ]
    lines += sentences_of(result)
    lines += ["", f"{n} samples, {seconds:.4g} s at {s['sample_rate']:.6g} Hz, method {s['method']}"]
    lines.append(f"{form}; regression windows of {rows} samples")
    flags = (in_words_of(result.units, line) for line in describe(result.status, result.record_status))
    return "\n".join([*lines, "", *flags])


def _rows(result: Any) -> Iterator[tuple[str, ...]]:
    """Return a row of cells for every parameter, with digits that go together."""
    values = {"inertia": result.inertia, "damping": result.damping, "stiffness": result.stiffness, **result.terms}
    for name, value in values.items():
        yield row_of(name, result.settings["kinds"][name], value, result.stderr[name], result.units)
    if "angle_zero" in result.constants:
        middle, spread = (float(np.nanmedian(one)) for one in result.constants["angle_zero"])
        unit = result.units["angle_zero"]
        yield "angle_zero", "constant", to_digits_of(middle, spread), "", "", own_digits(spread), unit
    for name in result.settings["inner"]:
        middle, spread = (float(np.nanmedian(one)) for one in result.constants[name])
        yield name, "searched", to_digits_of(middle, spread), "", "", own_digits(spread), result.units.get(name, "")


def row_of(
    name: str, kind: str, value: npt.NDArray[Any], error: npt.NDArray[Any], units: Mapping[str, str]
) -> tuple[str, ...]:
    """Return the cells of a parameter: median, range where it changes, and median standard error."""
    values, errors = (finite(told_once(one)) for one in (value, error))
    numbers = percentiles(values, 50, 5, 95)
    (middle,) = percentiles(errors, 50)
    shown = [to_digits_of(number, middle) for number in numbers]
    if kind not in CHANGING:
        shown[1] = shown[2] = ""
    return name, kind, *shown, own_digits(middle), units.get(name, "")


def sentences_of(result: Any) -> list[str]:
    """Return what to do, and what was chosen and why, as lines of a summary."""
    lines: list[str] = []
    for name, title in (("advice", "what to do"), ("reasons", "what was chosen, and why")):
        sentences = getattr(result, name)
        if sentences:
            lines += ["", title, *(f"  {sentence}" for sentence in sentences[:_MOST_SENTENCES])]
        if len(sentences) > _MOST_SENTENCES:
            lines.append(f"  and {len(sentences) - _MOST_SENTENCES} more in .{name}")
    return lines
