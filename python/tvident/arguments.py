"""Checks of what users pass: every message states the rule, the value that broke it and the cure."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable
from numbers import Integral, Real
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

Progress: TypeAlias = bool | Callable[[int, int], object] | None
"""``True`` shows a bar; a callable is given the work done and all of it."""

NanPolicy: TypeAlias = Literal["propagate", "raise"]
RowPolicy: TypeAlias = Literal["omit", "propagate", "raise"]
"""What to do about values that are no number, where windows may do without some of their rows."""

_READ_AS_THEY_ARE = frozenset(np.dtype(code) for code in ("f8", "f4", "i8", "i4", "i2", "i1", "u8", "u4", "u2", "u1"))
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}
# No whole number this large fits into the core's.
_BEYOND_COUNTING = 1 << 63
# How far a time stamp may lie from a uniform grid, as a fraction of the sample period: what printing with a few digits does.
_JITTER = 1e-3


def real_array(name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return values as an array of real numbers that the core reads without a copy of its own."""
    array = np.asarray(values)
    if array.dtype.kind == "c":
        raise TypeError(
            f"{name} must be real; got complex numbers ({array.dtype}); pass the real part or the magnitude"
        )
    if array.dtype.kind not in "biuf":
        raise TypeError(
            f"{name} must hold numbers; got {array.dtype}; convert them with np.asarray({name}, dtype=float)"
        )
    if array.ndim == 0:
        raise ValueError(f"{name} must be an array of samples; got the single number {array}; pass a sequence")
    if array.size == 0:
        raise ValueError(f"{name} must not be empty; got an array of shape {array.shape}; check how it was read or cut")
    if array.dtype not in _READ_AS_THEY_ARE:
        array = array.astype(np.float64)
    return array


def along_axis(name: str, array: npt.NDArray[Any], axis: int) -> npt.NDArray[Any]:
    """Return a view with the given axis last."""
    axis = whole_number("axis", axis)
    if not -array.ndim <= axis < array.ndim:
        raise ValueError(f"axis must name one of the {array.ndim} axes of {name}; got {axis}; use -1 for the last")
    return np.moveaxis(array, axis, -1)


def check_nan(name: str, array: npt.NDArray[Any], policy: str, policies: Any = NanPolicy) -> None:
    """Apply a policy for values that are no number, as far as it must be applied before any work."""
    one_of("nan_policy", policy, get_args(policies))
    if policy == "raise" and array.dtype.kind == "f" and not np.isfinite(array).all():
        place = tuple(int(index[0]) for index in np.nonzero(~np.isfinite(array)))
        where = place[0] if len(place) == 1 else place
        raise ValueError(
            f"{name} must hold finite numbers where nan_policy='raise'; sample {where} is {array[place]}; "
            "repair it or use nan_policy='propagate'"
        )


def whole_number(name: str, value: object, *, least: int | None = None) -> int:
    """Return a whole number, of at least a given size."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        whole = isinstance(value, Real) and math.isfinite(value) and float(value).is_integer()
        cure = f"pass {int(float(value))}" if whole else "pass an integer"  # type: ignore[arg-type]
        raise TypeError(f"{name} must be a whole number; got {value!r}; {cure}")
    if least is not None and value < least:
        raise ValueError(f"{name} must be at least {least}; got {value}; pass {least} or more")
    number = int(value)
    if number >= _BEYOND_COUNTING:
        raise ValueError(f"{name} must be less than 2^63; got {number}; pass a smaller number")
    return number


def positive_number(name: str, value: object) -> float:
    """Return a finite number above zero."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} must be a number; got {value!r}; pass a float")
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be positive and finite; got {number}; pass a number above zero")
    return number


def finite_number(name: str, value: object) -> float:
    """Return a finite number."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} must be a number; got {value!r}; pass a float")
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite; got {number}; pass a number")
    return number


def one_of(name: str, value: object, choices: tuple[str, ...]) -> str:
    """Return one of several words."""
    if value not in choices:
        *most, last = (repr(choice) for choice in choices)
        raise ValueError(f"{name} must be {', '.join(most)} or {last}; got {value!r}; use one of these")
    return str(value)


def sample_period(
    samples: int, *, delta: float | None = None, sample_rate: float | None = None, t: npt.ArrayLike | None = None
) -> float:
    """Return the sample period in seconds from whichever way it was given, 1 where it was not."""
    given = [name for name, value in (("delta", delta), ("sample_rate", sample_rate), ("t", t)) if value is not None]
    if len(given) > 1:
        raise TypeError(f"give only one of delta, sample_rate and t; got {' and '.join(given)}; drop all but one")
    if sample_rate is not None:
        return 1.0 / positive_number("sample_rate", sample_rate)
    if t is not None:
        return _period_of_times(t, samples)
    return 1.0 if delta is None else positive_number("delta", delta)


def _period_of_times(t: npt.ArrayLike, samples: int) -> float:
    """Return the period of times that are uniform within rounding."""
    times = real_array("t", t)
    if times.shape != (samples,):
        raise ValueError(
            f"t must hold one time for each of the {samples} samples; got shape {times.shape}; check its length"
        )
    if samples == 1:
        return 1.0
    rounding = 4 * float(np.spacing(np.ones(1, times.dtype if times.dtype.kind == "f" else np.float64))[0])
    seconds = times.astype(np.float64, copy=False)
    if not np.isfinite(seconds).all():
        place = int(np.flatnonzero(~np.isfinite(seconds))[0])
        raise ValueError(f"t must hold finite times; t[{place}] is {seconds[place]}; repair it")
    period = float(seconds[-1] - seconds[0]) / (samples - 1)
    if not period > 0:
        raise ValueError(f"t must increase; it goes from {seconds[0]} to {seconds[-1]}; sort the samples by time")
    distance = np.abs(seconds - (seconds[0] + period * np.arange(samples)))
    allowed = max(_JITTER * period, rounding * float(np.max(np.abs(seconds))))
    if float(distance.max()) > allowed:
        # The widest step tells where; the farthest sample may be an innocent one.
        steps = np.abs(np.diff(seconds) - np.median(np.diff(seconds)))
        place = int(steps.argmax()) + 1
        raise ValueError(
            f"t must be uniform; the step to t[{place}] = {seconds[place]:g} is {seconds[place] - seconds[place - 1]:g} s "
            f"where the others are {float(np.median(np.diff(seconds))):g} s; resample the record onto a uniform grid"
        )
    return period


def seconds(name: str, value: str) -> float:
    """Return the seconds of a duration such as ``"0.2 s"``."""
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-zµ]+)\s*", value)
    try:
        duration = float(match[1]) * _SECONDS[match[2]] if match else math.nan
    except (KeyError, ValueError):
        duration = math.nan
    if not (math.isfinite(duration) and duration > 0):
        units = ", ".join(_SECONDS)
        raise ValueError(f"{name} must be samples or a duration such as '0.2 s'; got {value!r}; units are {units}")
    return duration


def window_length(name: str, value: int | str, period: float, *, odd: bool) -> int:
    """Return a length in samples from a number of samples or a duration such as ``"0.2 s"``."""
    if isinstance(value, str):
        samples = seconds(name, value) / period
        return max(1, 2 * round((samples - 1) / 2) + 1) if odd else max(1, round(samples))
    length = whole_number(name, value, least=1)
    if odd and length % 2 == 0:
        raise ValueError(
            f"{name} must be odd, so that every window has a sample at its centre; got {length}; "
            f"use {length - 1} or {length + 1}"
        )
    return length


def check_window(name: str, length: int, samples: int, *, least: int = 1) -> None:
    """Check that a window is long enough to be one and fits into the record."""
    if length < least:
        raise ValueError(f"{name} must be at least {least} samples; got {length}; use {least} or more")
    if length > samples:
        raise ValueError(
            f"{name} must be less than or equal to the length of the record; got {length} samples for a record of {samples}; "
            f"use at most {samples} samples or a longer record"
        )


def mask(name: str, values: npt.ArrayLike | None, shape: tuple[int, ...]) -> npt.NDArray[np.bool_] | None:
    """Return a mask of the given shape, or nothing."""
    if values is None:
        return None
    array = np.asarray(values)
    if array.dtype != np.bool_:
        raise TypeError(f"{name} must hold True and False; got {array.dtype}; write {name} = {name} != 0")
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise ValueError(
            f"{name} must have one value for every sample; got shape {array.shape} for an angle of shape {shape}; check its length"
        ) from None


def worker_count(workers: int | None) -> int | None:
    """Return how many threads to use, or None for all processors that this process may use."""
    if workers is not None:
        return whole_number("workers", workers, least=1)
    setting = os.environ.get("TVIDENT_WORKERS", "").strip()
    if not setting:
        return None
    if not (setting.isascii() and setting.isdigit() and int(setting) > 0):
        raise ValueError(f"TVIDENT_WORKERS must be a whole number above zero; got {setting!r}; set it to 1 or more")
    return int(setting)
