"""What is given, what a preset says, and what an earlier result chose."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import tvident

RIG = tvident.simulate_torsional_rig(6.0, angle_noise=1e-3)
WHOLE: dict[str, Any] = {"sample_rate": 1000}


def drag(_t: Any, _angle: Any, velocity: Any) -> Any:
    return velocity * np.abs(velocity)


def same(one: tvident.Identification, other: tvident.Identification) -> None:
    for name, values in one.columns().items():
        np.testing.assert_array_equal(values, other.columns()[name], err_msg=name)
    assert one.constants == other.constants


@pytest.mark.parametrize(
    "call",
    [
        {"preset": "paper"},
        {"preset": "paper", "window_length": "0.15 s", "equations": "0.3 s", "damping": 0.008, "selection": "pooled"},
        {"preset": "paper", "inertia": "constant", "damping": "constant", "terms": ["offset"], "filter_torque": True},
        {"preset": "paper", "form": "weak", "window_length": 81, "inertia": "constant"},
        {"preset": "paper", "terms": [tvident.Term("drag", drag)], "inertia": 0.0123},
        {},
        {"inertia": "varying"},
        {"inertia": "windowed", "damping": "windowed", "stiffness": "windowed"},
        {"inertia": "constant", "damping": "constant", "stiffness": "constant", "terms": ()},
        {"inertia": 0.0123, "terms": ["offset", ("coulomb", "constant")], "lag": 0.0004},
        {"equations": 700, "exponent": 7},
        {"window_length": 101, "selection": "average", "equations": 500},
    ],
    ids=str,
)
def test_settings_given_back_give_the_same_numbers(call: dict[str, Any]) -> None:
    first = tvident.identify(RIG.angle, RIG.torque, **WHOLE, **call)
    again = tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=first.settings)
    same(first, again)
    if not any(isinstance(term, tvident.Term) for term, _ in first.settings["terms"]):
        same(first, tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=json.loads(json.dumps(first.settings))))


def test_settings_of_a_batch_hold_those_of_every_record() -> None:
    other = tvident.simulate_torsional_rig(6.0, seed=1, angle_noise=3e-2)
    angle, torque = np.stack([RIG.angle, other.angle]), np.stack([RIG.torque, other.torque])
    first = tvident.identify(angle, torque, **WHOLE)
    again = tvident.identify(angle, torque, **WHOLE, settings=first.settings)
    np.testing.assert_array_equal(first.stiffness, again.stiffness)
    np.testing.assert_array_equal(first.stderr["stiffness"], again.stderr["stiffness"])
    assert len(first.settings["window_length"]) == 2
    with pytest.raises(ValueError, match="window_length must be one number, or one for each of the 1 records; got 2"):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=first.settings)


def test_what_is_given_wins_over_settings_and_those_over_the_preset() -> None:
    paper = tvident.identify(RIG.angle, RIG.torque, **WHOLE, preset="paper", window_length=151)
    found = tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=paper.settings, equations=300)
    same(found, tvident.identify(RIG.angle, RIG.torque, **WHOLE, preset="paper", window_length=151, equations=300))
    known = tvident.identify(RIG.angle, RIG.torque, **WHOLE, preset="paper", stiffness=RIG.stiffness)
    with pytest.raises(ValueError, match=r"settings hold no stiffness.*pass stiffness= again"):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=known.settings)
    same(known, tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=known.settings, stiffness=RIG.stiffness))


def test_nothing_given_is_chosen_from_the_record() -> None:
    default = tvident.identify(RIG.angle, RIG.torque, **WHOLE)
    same(default, tvident.identify(RIG.angle, RIG.torque, **WHOLE, preset="auto", form="auto", selection="auto"))
    assert default.settings["preset"] == "auto"
    assert default.settings["form"] == "weak"
    # A known length means windows of that length.
    assert tvident.identify(RIG.angle, RIG.torque, **WHOLE, equations=400).settings["selection"] == "window"


def test_selection_of_the_strong_form_is_that_of_the_derivatives() -> None:
    call: dict[str, Any] = {"preset": "paper", "window_length": 101}
    for selection in ("window", "pooled", "average"):
        found = tvident.identify(RIG.angle, RIG.torque, **WHOLE, **call, selection=selection)
        fit = tvident.fit_local_polynomials(RIG.angle, 101, **WHOLE, selection=selection)
        middle = slice(200, -200)
        np.testing.assert_array_equal(found.order[middle], fit.order[middle])
        theta, velocity, acceleration = fit.derivatives[:, 50:-50]
        rows = tvident.rolling_least_squares(np.stack([acceleration, velocity, theta], axis=1), RIG.torque[50:-50], 200)
        np.testing.assert_allclose(found.stiffness[middle], rows.params[150:-150, 2], rtol=1e-9)
    strong = tvident.identify(RIG.angle, RIG.torque, **WHOLE, form="strong")
    assert strong.settings["selection"] == "pooled"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"form": "strong", "exponent": 6}, "exponent belongs to the weak form; got 6 with form='strong'"),
        ({"form": "strong", "exponent": "auto"}, "exponent belongs to the weak form; got 'auto' with form='strong'"),
        ({"preset": "paper", "exponent": 9}, "exponent belongs to the weak form.*leave it out, or give form='weak'"),
        ({"form": "weak", "max_order": 15}, "max_order belongs to the strong form; got 15 with form='weak'"),
        ({"form": "weak", "criterion": "aicc"}, "criterion belongs to the strong form; got 'aicc' with form='weak'"),
        ({"max_order": 9}, "max_order belongs to the strong form; got 9 with form='weak'.*give form='strong'"),
        ({"filter_torque": True}, "filter_torque belongs to the strong form; got True"),
        ({"selection": "pooled"}, "selection must be 'window' or 'average' in weak form.*or form='strong'"),
        ({"preset": "paper", "window_length": "auto"}, "window_length must be a number of samples.*got 'auto'"),
        ({"preset": "paper", "equations": "auto"}, "equations must be a number of samples.*200 in the paper"),
        ({"settings": {"kinds": 1}}, "settings must be those of an earlier result"),
    ],
)
def test_what_would_change_nothing_is_refused(call: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, **call)
