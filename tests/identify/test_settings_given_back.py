"""Settings of any result are accepted again, those of one that found nothing among them; what is no settings is refused."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import tvident
from calls import paper, strong, weak

N = 400
TIME = np.arange(N) / 1000
ANGLE = 0.2 * np.sin(2 * np.pi * 9 * TIME) + 0.1 * np.sin(2 * np.pi * 31 * TIME)
TORQUE = 15 * ANGLE + 0.01 * np.gradient(np.gradient(ANGLE, TIME), TIME)
NOTHING = np.full(N, np.nan)

METHODS: dict[str, dict[str, Any]] = {
    "auto": {},
    "weak": weak(),
    "weak, given": weak(window_length=51, exponent=5, regression_window=30),
    "paper": paper(window_length=51, regression_window=40),
    "strong": strong(window_length=51, regression_window=40),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "records",
    [
        (NOTHING, NOTHING),
        (np.zeros(N), np.zeros(N)),
        (NOTHING, TORQUE),
        (np.stack([ANGLE, NOTHING]), np.stack([TORQUE, TORQUE])),
    ],
    ids=["missing", "resting", "no angle", "one of two"],
)
def test_settings_of_a_result_that_found_nothing(method: str, records: tuple[Any, Any]) -> None:
    result = tvident.identify(*records, sample_rate=1000, **METHODS[method])
    settings = json.loads(json.dumps(result.settings))
    again = tvident.identify(*records, sample_rate=1000, settings=settings)
    np.testing.assert_array_equal(again.stiffness, result.stiffness)
    np.testing.assert_array_equal(again.status, result.status)
    assert "samples" in result.summary()
    other = tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=settings) if result.stiffness.ndim == 1 else None
    assert other is None or np.isfinite(other.stiffness).any()


def test_what_was_given_stands_where_nothing_was_found() -> None:
    result = tvident.identify(NOTHING, NOTHING, sample_rate=1000, **METHODS["weak, given"])
    assert (result.settings["window_length"], result.settings["exponent"]) == (51, 5)
    assert result.settings["regression_window"] == 30
    chosen = tvident.identify(NOTHING, NOTHING, sample_rate=1000)
    assert chosen.settings["regression_window"] == "auto"


RESULT = tvident.identify(ANGLE, TORQUE, sample_rate=1000, lag="auto").settings


@pytest.mark.parametrize(
    "settings",
    [{}, 5, "settings", [], object(), RESULT | {"form": "other"}, RESULT | {"form": []}, RESULT | {"kinds": {}}]
    + [
        RESULT | {"known": 3},
        RESULT | {"chosen": None},
        RESULT | {"lag_samples": 3},
        RESULT | {"terms": [1]},
        RESULT | {"own_terms": 1},
    ]
    + [
        {name: value for name, value in RESULT.items() if name != left}
        for left in ("form", "method", "exponent", "lag", "terms")
    ],
)
def test_what_is_no_settings_is_refused(settings: Any) -> None:
    with pytest.raises(TypeError, match=r"settings must be those of an earlier result; got .*; pass result.settings"):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=settings)


@pytest.mark.parametrize(
    "changed",
    [
        {"window_length": -3},
        {"exponent": "many"},
        {"quantisation": "x"},
        {"lag": [0.0, 1.0]},
        {"kinds": RESULT["kinds"] | {"inertia": "other"}},
        {"lag_samples": ["x"]},
        {"terms": [["other", "constant"]]},
    ],
)
def test_settings_that_were_changed_are_checked_as_arguments_are(changed: Any) -> None:
    with pytest.raises((ValueError, TypeError), match=r" must .*; got .*; "):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=RESULT | changed)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"window_lenght": 31}, r"got 'window_lenght'; did you mean 'window_length'\?"),
        ({"regression": 31}, r"got 'regression'; did you mean 'regression_window'\?"),
        ({"max_order": 7}, r"got 'max_order'; it belongs to the strong form"),
        ({"comment": "second trial"}, r"got 'comment'; "),
        (
            {"kinds": RESULT["kinds"] | {"inertai": "constant"}},
            r"settings kinds .* got 'inertai'; did you mean 'inertia'\?",
        ),
        ({"known": {"stifness": 3.0}}, r"settings known .* got 'stifness'; did you mean 'stiffness'\?"),
    ],
)
def test_names_that_no_result_has_are_refused(more: dict[str, Any], words: str) -> None:
    settings = RESULT | more
    with pytest.raises(TypeError, match=words):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=settings)
    with pytest.raises(TypeError, match=words):
        tvident.IdentificationStream(sample_rate=1000, settings=settings)
