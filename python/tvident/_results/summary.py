"""The summary of a result."""

from __future__ import annotations

from typing import Any

import numpy as np

from tvident._files import aligned
from tvident._status import describe

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
def summary_of(result: Any) -> str:
    """Return what :meth:`tvident.Identification.summary` does."""
    s = result.settings
    n, seconds = result.time.size, float(result.time[-1] - result.time[0]) if result.time.size else 0.0
    lines = [
        result.held_back().words(),
        f"{n} samples, {seconds:.4g} s at {s['sample_rate']:.6g} Hz, method {s['method']}",
    ]
    length, rows = (_range(s[name]) for name in ("window_length", "regression_window"))
    if s["form"] == "strong":
        lines.append(
            f"strong form: windows of {length} samples, orders up to {s['max_order']} by {s['criterion']}; "
            f"regression windows of {rows} samples"
        )
    else:
        lines.append(
            f"weak form: test functions of {length} samples, exponent {_range(s['exponent'])}; "
            f"regression windows of {rows} samples"
        )
    lines.append("")
    cells = [("parameter", "kind", "median", "5 %", "95 %", "std. error", "unit")]
    values = {"inertia": result.inertia, "damping": result.damping, "stiffness": result.stiffness, **result.terms}
    for name, value in values.items():
        kind = s["kinds"][name]
        finite, error = value[np.isfinite(value)], result.stderr[name]
        numbers = np.percentile(finite, [50, 5, 95]) if finite.size else [np.nan] * 3
        error = error[np.isfinite(error)]
        shown = [f"{number:.5g}" for number in numbers] + [f"{np.median(error):.2g}" if error.size else "nan"]
        if kind not in {"windowed", "varying"}:
            shown[1] = shown[2] = ""
        cells.append((name, kind, *shown, result.units.get(name, "")))
    for name in s["inner"]:
        middle, spread = (float(np.nanmedian(one)) for one in result.constants[name])
        cells.append((name, "searched", f"{middle:.5g}", "", "", f"{spread:.2g}", result.units.get(name, "")))
    lines += aligned(cells)
    for name, title in (("reasons", "what was chosen, and why"), ("advice", "what to do")):
        sentences = getattr(result, name)
        if sentences:
            lines += ["", title, *(f"  {sentence}" for sentence in sentences[:_MOST_SENTENCES])]
        if len(sentences) > _MOST_SENTENCES:
            lines.append(f"  and {len(sentences) - _MOST_SENTENCES} more in .{name}")
    lines += ["", *describe(result.status, result.record_status)]
    return "\n".join(lines)
