"""What holds no real numbers is refused by every function with one message that says what it is and what to do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tvident

GOOD = np.sin(np.arange(300) / 20)
WHOLE = np.arange(300)

FUNCTIONS: dict[str, tuple[str, Callable[[Any], object]]] = {
    "fit_local_polynomials": ("y", lambda values: tvident.fit_local_polynomials(values, 31)),
    "times": ("t", lambda values: tvident.fit_local_polynomials(GOOD, 31, t=values)),
    "savgol_filter": ("x", lambda values: tvident.savgol_filter(values, 31, 3)),
    "rolling_least_squares, A": ("A", lambda values: tvident.rolling_least_squares(values, GOOD, 31)),
    "rolling_least_squares, b": ("b", lambda values: tvident.rolling_least_squares(GOOD, values, 31)),
    "identify, angle": ("angle", lambda values: tvident.identify(values, GOOD, sample_rate=1000)),
    "identify, torque": ("torque", lambda values: tvident.identify(GOOD, values, sample_rate=1000)),
    "identify, known": ("damping", lambda values: tvident.identify(GOOD, GOOD, sample_rate=1000, damping=values)),
}

VALUES: dict[str, tuple[Any, str]] = {
    "complex": (GOOD + 1j, "must be real; got complex numbers .complex128.; pass the real part or the magnitude"),
    "objects": (GOOD.astype(object), "must hold numbers; got object; convert them with np.asarray"),
    "dates": (WHOLE.astype("M8[s]"), "must hold numbers; got dates; take seconds from the first sample on"),
    "durations": (WHOLE.astype("m8[s]"), "must hold numbers; got durations; divide them by"),
    "text": (WHOLE.astype("U5"), "must hold numbers; got text; read it with"),
    "bytes": (WHOLE.astype("S5"), "must hold numbers; got text; read it with"),
    "fields": (
        np.zeros(300, dtype=[("x", "f8")]),
        "must hold numbers; got records with fields x; take one field by its name: .*'x'",
    ),
    "dictionary": ({"a": 1}, "must hold numbers; got records with fields a; take one field by its name: .*'a'"),
    "masked complex": (np.ma.masked_array(GOOD + 1j, mask=GOOD > 0), "must be real; got complex numbers"),
    "large": ([10**400] * 300, "must hold numbers; got object"),
}


TAKEN = {("times", "dates"), ("times", "durations"), ("fit_local_polynomials", "fields"), ("savgol_filter", "fields")}
"""Times may be dates, and a structured array is a table of signals."""


@pytest.mark.parametrize(
    ("function", "kind"),
    [(function, kind) for function in FUNCTIONS for kind in VALUES if (function, kind) not in TAKEN],
)
def test_what_is_no_real_number_is_refused(function: str, kind: str) -> None:
    name, call = FUNCTIONS[function]
    values, message = VALUES[kind]
    with pytest.raises(TypeError, match=f"^{name} {message}"):
        call(values)


def test_none_among_the_torques_of_records_is_named() -> None:
    """It was called an object that can be converted."""
    with pytest.raises(
        TypeError, match=r"^torque must hold numbers; got None; give an array of numbers \(record 1 of 2\)"
    ):
        tvident.identify([GOOD, GOOD], [GOOD, None], sample_rate=1000)  # type: ignore[list-item]


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([[1.0, 2.0], [3.0]], "must be a regular array of numbers; got"),
        ([], "must not be empty; got an array of shape"),
    ],
    ids=["ragged", "empty"],
)
def test_what_is_no_array_is_refused(function: str, values: Any, message: str) -> None:
    name, call = FUNCTIONS[function]
    # A ragged list of numbers is two records beside one of the other channel.
    with pytest.raises(ValueError, match=f"^({name} {message}|every channel must have as many records)"):
        call(values)


@pytest.mark.parametrize("mask", [GOOD, WHOLE, ["a"] * 300, GOOD.astype(object), 1])
def test_a_mask_holds_true_and_false(mask: Any) -> None:
    with pytest.raises(TypeError, match=r"^mask must hold True and False; got .*; write mask = mask != 0"):
        tvident.identify(GOOD, GOOD, sample_rate=1000, mask=mask)


@pytest.mark.parametrize("name", ["inertia", "damping", "stiffness"])
def test_a_parameter_is_neither_true_nor_false(name: str) -> None:
    for value in (True, False, np.bool_(1)):
        known: dict[str, Any] = {name: value}
        with pytest.raises(TypeError, match=f"^{name} must be a number, an array or a kind; got {bool(value)}; write"):
            tvident.identify(GOOD, GOOD, sample_rate=1000, **known)
