"""Sample rates and periods with the units in which programs write them."""

from __future__ import annotations

import math
import re

from tvident._units.quantities import UnitError, factor_between

_A_SECOND = re.compile(r"(k?)(?:sa?|samples?|scans?)(?:/s|/sec|ps)", re.IGNORECASE)
"""Units that count samples in a second, as kS/s."""

_WITH_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s.,][^\d,]*)?\s*")


def rate_of(value: float, unit: str, *, is_rate: bool) -> float | None:
    """Return a rate, or one over a period, in samples per second; None where the unit is another, or a period has none."""
    counted = _A_SECOND.fullmatch(unit)
    if is_rate and counted is not None:
        return value * (1e3 if counted[1] else 1.0)
    if not is_rate and not unit:
        return None
    try:
        scaled = value * factor_between(unit, "Hz" if is_rate else "s", name="the rate")
    except UnitError:
        return None
    rate = scaled if is_rate else 1 / scaled
    return rate if math.isfinite(rate) else None


def rate_said(text: str) -> float | None:
    """Return the samples per second of a text that says a rate with its unit, as 1 kHz, or without; None where it says something else."""
    found = _WITH_UNIT.fullmatch(text)
    return rate_of(float(found[1]), (found[2] or "").strip(), is_rate=True) if found else None
