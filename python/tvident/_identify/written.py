"""What settings of a result hold of what was found: a lag, and which coefficients change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from tvident import _core
from tvident._equation import Unknown
from tvident._identify.settings import Request


def lag_that_was_found(
    request: Request, found: Sequence[_core.Identification], by_record: Callable[[Sequence[Any]], Any], period: float
) -> dict[str, Any]:
    """Return the lag in seconds and samples, its standard error and what is not told of it, as found here or by an earlier result."""
    if request.lag != "auto":
        kept = {
            "lag_stderr": request.lag_stderr,
            "lag_samples": request.lag_samples,
            "lag_untold": list(request.lag_untold) or None,
        }
        return {name: value for name, value in kept.items() if value is not None}
    lags = [(0.0, None) if one.lag is None else (one.lag.value, one.lag.stderr) for one in found]
    return {
        "lag": by_record([late * period for late, _ in lags]),
        "lag_stderr": by_record([None if error is None else error * period for _, error in lags]),
        "lag_samples": [late for late, _ in lags],
        **({"lag_untold": [one.untold_lag for one in found]} if any(one.untold_lag for one in found) else {}),
    }


def tested_in_order(unknowns: Sequence[Unknown], found: Sequence[_core.Identification], request: Request) -> list[str]:
    """Return the coefficients whose kinds the record decided: those that change first, in the order in which they were found to."""
    names = [one.name for one in unknowns if one.kind == "auto" or one.name in request.tested]
    changing = [unknowns[place].name for place in found[0].changing if place < len(unknowns)] if found else []
    return [name for name in changing if name in names] + [name for name in names if name not in changing]
