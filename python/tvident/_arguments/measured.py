"""Numbers that know their unit: quantities of pint, astropy and unyt, durations of Python, NumPy and pandas."""

from __future__ import annotations

import datetime as dt
from typing import Any, Final

import numpy as np

from tvident._units import factor_between, in_its_unit, unit_said

_UNITS: Final = {
    "sample_rate": "Hz",
    **dict.fromkeys(
        ("delta", "duration", "lag", "align", "begin", "end", "t0", "t1", "start", "resolution", "more"), "s"
    ),
    **dict.fromkeys(("window_length", "regression_window", "half_life", "max_gap"), "s"),
}
"""In what numbers are taken that may be quantities."""

_SECOND = np.timedelta64(1, "s")


def knows_its_unit(value: object) -> bool:
    """Return whether a single number says its unit itself, or is a duration."""
    if type(value) is float or type(value) is int or isinstance(value, str):
        return False
    if isinstance(value, dt.timedelta | np.timedelta64):
        return True
    return bool(unit_said(value)) and np.size(_plain(value)) == 1


def measured(name: str, value: Any) -> float | None:
    """Return a quantity in the unit that an argument is taken in; None where it is none, or the argument has no unit.

    Raises
    ------
    ValueError
        If it is a quantity of another kind, or a duration of no length in seconds.
    """
    wanted = _UNITS.get(name)
    if wanted is None or not knows_its_unit(value):
        return None
    if isinstance(value, dt.timedelta):
        return value.total_seconds() if wanted == "s" else None
    if isinstance(value, np.timedelta64):
        return _seconds(name, value) if wanted == "s" else None
    factor = factor_between(unit_said(value), wanted, name=name)
    try:
        return float(np.asarray(_plain(value), dtype=np.float64).reshape(-1)[0]) * factor
    except (TypeError, ValueError):  # of words with a unit
        return None


def _seconds(name: str, value: np.timedelta64) -> float:
    """Return the seconds of a duration of NumPy; one without a unit says nothing, and months and years have no length."""
    unit = np.datetime_data(value.dtype)[0]
    if np.isnat(value) or unit in {"generic", "M", "Y"}:
        got = "NaT" if np.isnat(value) else f"{value.astype(int)} without a unit" if unit == "generic" else str(value)
        raise ValueError(
            f"{name} must be a duration in weeks, days, hours or a smaller unit; got {got}; give seconds, or "
            f"numpy.timedelta64(1, 'ms')"
        )
    return float(value / _SECOND)


def _plain(value: Any) -> Any:
    """Return the number of a quantity without its unit."""
    plain = in_its_unit(value)
    return getattr(plain, "value", plain) if hasattr(plain, "unit") and not isinstance(plain, np.ndarray) else plain
