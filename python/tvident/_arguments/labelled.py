"""Times that containers say their samples have: dates, durations, and numbers whose unit is said or not."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments.containers import package_of
from tvident._arguments.sampling import may_be_days
from tvident._arguments.times import times_of
from tvident._units import ROTARY, factor_to, is_convertible, named_unit, times_in_seconds, unit_said

_OTHER_RATE = 0.1
"""Times of few digits and gaps move steps by less than this part; a wrong rate is off by more."""

_CLOSER = (
    r"(unix|epoch|utc|gps|abs(olute)?|rel(ative)?|elapsed|running|recording|system|mess|sim(ulation)?|wall|up|robot|controller|ros|log"
    r"|publish|receive|bag)[ _.-]{0,2}(time|zeit|(time)?stamp)|time[ _.-]?(unix|epoch|utc|abs(olute)?|rel(ative)?)"
)
"""What times are called that say whose clock they are of."""

_CALLED = re.compile(
    r"_{0,2}(t|tout|time|times|zeit|temps|tiempo|tempo|x_value|timestamps?|stamp|elapsed( time)?|time[_ ]?stamp"
    rf"|{_CLOSER})([ _.-]?\d+)?",
    re.IGNORECASE,
)
"""What times are called: ``tout`` by Simulink, ``stamp`` by robots."""

_OF_ONE_CLOCK = re.compile(rf"_{{0,2}}({_CLOSER})([ _.-]?\d+)?", re.IGNORECASE)

_UNITS = (1.0, 1e-3, 1e-6, 1e-9, 60.0, 3600.0, 86400.0)
"""Seconds of what times without a unit may be in."""


def implied_times(values: Any) -> Any:
    """Return the times that a container says its samples have; None where it has none.

    They are dates, durations, or numbers that are called as times: with their unit, or in seconds if they are no whole numbers.

    Other plain numbers are none, since nobody says whether they are seconds. With xarray the attribute ``units`` may say so.
    """
    for name, labels in _labels(values):
        if _says_times(labels) or _is_named_time(name, labels):
            return labels
    return None


def cure_by_labels(values: Any) -> str:
    """Return what to give if the numbers that label samples are times, though nobody says so; nothing where there are none."""
    for name, labels in _labels(values):
        numbers = np.asarray(labels)
        if numbers.ndim != 1 or numbers.dtype.kind not in "iuf" or numbers.size < 2:  # noqa: PLR2004 - a step
            continue
        step = float(numbers[-1] - numbers[0]) / (numbers.size - 1)
        # What counts samples is no time.
        if not step > 0 or numbers.dtype.kind != "f":
            continue
        times = "angle.index" if package_of(values) == "pandas" else f"angle[{name!r}]"
        return f"; the samples are labelled in steps of {step:.6g}: give t={times}{_cure_of_unit(name, step)}"
    return ""


def _cure_of_unit(name: Any, step: float) -> str:
    """Return what else to give beside labels in such steps, so that their unit is known."""
    _, unit = named_unit(name) if isinstance(name, str) else ("", "")
    if unit:
        # A unit of time would have been read.
        return f" and time_unit='ms', say: {unit!r} is no unit of time, or may mean several"
    if may_be_days(step):
        return f" and time_unit='days' if they are days ({1 / (86_400 * step):.6g} Hz)"
    return f" if they are seconds ({1 / step:.6g} Hz), and time_unit='ms' too if they are milliseconds"


def _labels(values: Any) -> list[tuple[Any, Any]]:
    """Return what labels the samples of a container, and how it is called."""
    if package_of(values) == "pandas" and hasattr(values, "index"):
        index = values.index
        # Spans of time begin at their stamps.
        is_spans = hasattr(index, "to_timestamp") and hasattr(index, "end_time")
        return [(getattr(index, "name", None), index.to_timestamp() if is_spans else index)]
    if package_of(values) == "xarray" and hasattr(values, "dims") and hasattr(values, "coords"):
        return [(dim, values.coords[dim]) for dim in values.dims if dim in values.coords]
    return []


def _says_times(labels: Any) -> bool:
    """Return whether labels are dates or durations, or numbers in a unit of time."""
    kind = getattr(getattr(labels, "dtype", None), "kind", "O")
    if kind in "mM":
        return True
    return kind in "iuf" and is_convertible(ROTARY, "time", unit_said(labels))


def _is_named_time(name: Any, labels: Any) -> bool:
    """Return whether numbers are called as times: with a unit, or without one where they are fractions, as whole ones may count samples."""
    kind = getattr(getattr(labels, "dtype", None), "kind", "O")
    bare, unit = named_unit(name) if isinstance(name, str) else ("", "")
    if kind not in "iuf" or unit_said(labels):
        return False
    return is_time(bare, unit) and (bool(unit) or (kind == "f" and _has_fractions(labels)))


def _has_fractions(labels: Any) -> bool:
    numbers = np.asarray(labels, dtype=np.float64)
    return bool((numbers != np.round(numbers)).any())


def check_against_labels(values: Any, period: float) -> None:
    """Refuse a sample period that is another than what a container says its samples have.

    Raises
    ------
    ValueError
        If both the mean and the median step of the labels are far from it.
    """
    implied = next((labels for _, labels in _labels(values) if _says_times(labels)), None)
    if implied is None:
        _check_against_numbers(values, period)
    if implied is None or len(implied) < 2:  # noqa: PLR2004 - a step
        return
    seconds = np.asarray(times_of(times_in_seconds(implied)), dtype=np.float64)
    steps = (float(np.median(np.diff(seconds))), float(seconds[-1] - seconds[0]) / (seconds.size - 1))
    if all(step > 0 and abs(period / step - 1) > _OTHER_RATE for step in steps):
        raise ValueError(
            f"the sample period must be that of the times that the samples are labelled with; got {period:.6g} s ({1 / period:.6g} Hz), "
            f"and labels {steps[0]:.6g} s apart ({1 / steps[0]:.6g} Hz); leave it out, or pass .to_numpy() if the labels are wrong"
        )


def _check_against_numbers(values: Any, period: float) -> None:
    """Refuse a sample period that labels which are called as times show in no unit they may have; what merely counts samples shows none."""
    labels, units = _called_times(values)
    if labels.size < 2 or not np.isfinite(labels).all():  # noqa: PLR2004 - a step
        return
    steps = np.diff(labels)
    usual, mean = float(np.median(steps)), float(labels[-1] - labels[0]) / steps.size
    if usual <= 0 or (steps == 1).all() or abs(mean / usual - 1) > _OTHER_RATE:
        return
    if all(abs(period / (usual * unit) - 1) > _OTHER_RATE for unit in units):
        step = usual * units[0]
        known = f"{step:.6g} s apart ({1 / step:.6g} Hz)"
        if len(units) > 1:
            known = f"{usual:.6g} apart ({1 / step:.6g} Hz if they are seconds)"
        raise ValueError(
            f"the sample period must be that of the labels of the samples, which are called as times are; got {period:.6g} s "
            f"({1 / period:.6g} Hz), and labels {known}; give the labels as t=, or pass .to_numpy() if they are wrong"
        )


def _called_times(values: Any) -> tuple[npt.NDArray[np.float64], tuple[float, ...]]:
    """Return numbers that label samples and are called as times are, none where there are none, and seconds of what they may be in."""
    for name, labels in _labels(values):
        bare, unit = named_unit(name) if isinstance(name, str) else ("", "")
        unit = unit or unit_said(labels)
        is_numbers = getattr(getattr(labels, "dtype", None), "kind", "O") in "iuf"
        if is_numbers and is_time(bare, unit):
            units = (factor_to(ROTARY, "time", unit, name="the time"),) if unit else _UNITS
            return np.asarray(labels, dtype=np.float64), units
    return np.empty(0), ()


def is_called_time(name: str) -> bool:
    """Return whether a name, without its unit, is what times are called."""
    return _CALLED.fullmatch(name) is not None


def is_of_one_clock(name: str) -> bool:
    """Return whether a name, without its unit, says of which clock its times are: another may have begun long before."""
    return _OF_ONE_CLOCK.fullmatch(name) is not None


def is_time(name: str, unit: str) -> bool:
    """Return whether what is called so, in this unit or none, holds times."""
    return is_called_time(name) and (not unit or is_convertible(ROTARY, "time", unit))
