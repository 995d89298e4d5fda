"""A user's term has a name of its own and cannot change what it is given."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident

Array = npt.NDArray[np.float64]

N = 1500
TIME = np.arange(N) / 1000
ANGLE = 0.2 * np.sin(2 * np.pi * 2 * TIME) + 0.1 * np.sin(2 * np.pi * 7 * TIME)
TORQUE = 15 * ANGLE + 0.01 * np.gradient(np.gradient(ANGLE, TIME), TIME)


def drag(_t: Array, _angle: Array, velocity: Array) -> Array:
    return velocity * np.abs(velocity)


@pytest.mark.parametrize("name", ["drag", "Drag 2", "hardening_cubed", "c-3.b", "Reibung ö", "摩擦"])
def test_names_of_letters_and_digits_are_kept(name: str) -> None:
    result = tvident.identify(ANGLE, TORQUE, sample_rate=1000, terms=[tvident.Term(name, drag)])
    assert list(result.terms) == [name]
    assert name in result.columns()


def test_every_column_of_a_result_is_taken() -> None:
    columns = tvident.identify(
        ANGLE, TORQUE, sample_rate=1000, terms=["offset", "coulomb", "cubic", "gravity"]
    ).columns()
    assert len(columns) > 20
    for name in columns:
        for written in (name, name.upper(), name.title()):
            with pytest.raises(ValueError, match=r"must be its own; got .* taken in results: call it 'own "):
                tvident.Term(written, drag)


@pytest.mark.parametrize(
    "name", ["angle", "torque", "velocity", "drag_stderr", "stiffness_stderr", "stderr", "natural frequency"]
)
def test_names_of_channels_and_errors_are_taken(name: str) -> None:
    with pytest.raises(ValueError, match=f"must be its own; got '{name}'") as refused:
        tvident.Term(name, drag)
    (proposed,) = re.findall(r"call it '(.*)', say", str(refused.value))
    assert tvident.Term(proposed, drag).name == proposed


@pytest.mark.parametrize(
    "name",
    [
        "",
        " ",
        "a,b",
        "a\nb",
        "a\r",
        "=1+1",
        "+1",
        "-1",
        "@a",
        "2nd",
        "a\x1b[31m",
        "a\u202eb",
        "a;b",
        'a"b',
        "drag [N]",
        "a\t",
        " drag",
        "drag ",
        "d" * 61,
        "a\u2028b",
        "_hidden",
        "a'b",
        "a=b",
        "d\x00",
    ],
)
def test_names_hold_nothing_that_files_and_terminals_take_for_something_else(name: str) -> None:
    with pytest.raises(
        ValueError, match=r"the name of a term must begin with a letter and hold nothing but .*; call it"
    ):
        tvident.Term(name, drag)


@pytest.mark.parametrize("name", [None, 5, b"drag", ("drag",), np.ones(3)])
def test_a_name_is_a_word(name: Any) -> None:
    with pytest.raises(TypeError, match="the name of a term must be a word; got"):
        tvident.Term(name, drag)


def test_a_function_can_be_called() -> None:
    function: Any = "drag"
    with pytest.raises(TypeError, match="the function of term 'drag' must be callable; got 'drag'; pass"):
        tvident.Term("drag", function)


def test_names_that_differ_in_capitals_only_are_the_same() -> None:
    with pytest.raises(ValueError, match="every term must have a name of its own"):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, terms=[tvident.Term("a", drag), tvident.Term("A", drag)])


@pytest.mark.parametrize("method", ["auto", "paper"])
def test_a_function_that_writes_to_what_it_is_given_changes_nothing(method: Any) -> None:
    def spoiling(t: Array, angle: Array, velocity: Array) -> Array:
        found = drag(t, angle, velocity)
        for values in (t, angle, velocity):
            values[:] = 5
        return found

    terms = [
        [tvident.Term("one", function), tvident.Term("two", lambda t, a, _v: a**3 + t)] for function in (drag, spoiling)
    ]
    plain, spoilt = (tvident.identify(ANGLE, TORQUE, sample_rate=1000, method=method, terms=some) for some in terms)
    np.testing.assert_array_equal(spoilt.time, plain.time)
    np.testing.assert_array_equal(spoilt.stiffness, plain.stiffness)
    np.testing.assert_array_equal(spoilt.terms["two"], plain.terms["two"])


@pytest.mark.parametrize(
    ("returned", "error", "message"),
    [
        (
            None,
            TypeError,
            "what the function of term 'own' returns must hold numbers; got None; give an array of numbers",
        ),
        (1j * TIME, TypeError, "what the function of term 'own' returns must be real"),
        (["a"] * N, TypeError, "what the function of term 'own' returns must hold numbers; got text"),
        (TIME.astype("M8[s]"), TypeError, "what the function of term 'own' returns must hold numbers; got dates"),
        (TIME[:-1], ValueError, r"the function of term 'own' must return an array of shape \(1500,\); got \(1499,\)"),
        (3.0, ValueError, r"must return an array of shape \(1500,\); got \(\); return one value for every sample"),
        ([[1.0], [1.0, 2.0]], ValueError, "what the function of term 'own' returns must be a regular array of numbers"),
    ],
)
def test_what_a_function_returns_is_checked(returned: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, terms=[tvident.Term("own", lambda _t, _a, _v: returned)])
