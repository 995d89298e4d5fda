"""What is given, what a method says, and what an earlier result chose."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

import tvident
from calls import paper, plain_weak, strong, weak
from tvident import _arguments as arguments

RIG = tvident.simulate_torsional_rig(6.0, angle_noise=1e-3)
WHOLE: dict[str, Any] = {"sample_rate": 1000}


def drag(_t: Any, _angle: Any, velocity: Any) -> Any:
    return velocity * np.abs(velocity)


DRAG = tvident.Term("drag", drag)


def same(one: tvident.Identification, other: tvident.Identification) -> None:
    for name, values in one.columns().items():
        np.testing.assert_array_equal(values, other.columns()[name], err_msg=name)
    assert one.constants == other.constants


def without_addresses(call: dict[str, Any]) -> str:
    """Name a call alike in every process."""
    return re.sub(" at 0x[0-9a-f]+", "", str(call))


@pytest.mark.parametrize(
    "call",
    [
        {"method": "paper"},
        paper(window_length="0.15 s", regression_window="0.3 s", damping=0.008, selection="pooled"),
        paper(inertia="constant", damping="constant", terms=["offset"], filter_torque=True),
        plain_weak(window_length=81, inertia="constant"),
        {"method": "paper", "terms": [DRAG], "inertia": 0.0123},
        {},
        {"inertia": "varying"},
        {"inertia": "windowed", "damping": "windowed", "stiffness": "windowed"},
        {"inertia": "constant", "damping": "constant", "stiffness": "constant", "terms": ()},
        {"inertia": 0.0123, "terms": ["offset", ("coulomb", "constant")], "lag": 0.0004},
        {"terms": [("offset", "constant"), (DRAG, "constant")]},
        weak(regression_window=700, exponent=7),
        weak(window_length=101, averaging=True, regression_window=500),
        strong(variation="linear"),
    ],
    ids=without_addresses,
)
def test_settings_given_back_give_the_same_numbers(call: dict[str, Any]) -> None:
    first = tvident.identify(RIG.angle, RIG.torque, **WHOLE, **call)
    earlier = json.loads(json.dumps(first.settings))
    assert earlier == first.settings
    terms = {"terms": call["terms"]} if first.settings["own_terms"] else {}
    again = tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=earlier, **terms)
    same(first, again)
    assert again.settings == first.settings


def test_a_term_of_ones_own_is_given_again() -> None:
    first = tvident.identify(RIG.angle, RIG.torque, **WHOLE, terms=["offset", (DRAG, "windowed")])
    message = "settings hold no functions, and term 'drag' is one of the user's own; .*pass terms= again, with all of offset, drag"
    with pytest.raises(ValueError, match=message):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=first.settings)
    # Its kind need not be.
    same(first, tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=first.settings, terms=["offset", DRAG]))


def test_settings_of_a_batch_hold_those_of_every_record() -> None:
    other = tvident.simulate_torsional_rig(6.0, seed=1, angle_noise=3e-2)
    angle, torque = np.stack([RIG.angle, other.angle]), np.stack([RIG.torque, other.torque])
    first = tvident.identify(angle, torque, **WHOLE)
    again = tvident.identify(angle, torque, **WHOLE, settings=json.loads(json.dumps(first.settings)))
    np.testing.assert_array_equal(first.stiffness, again.stiffness)
    np.testing.assert_array_equal(first.stderr["stiffness"], again.stderr["stiffness"])
    assert len(first.settings["window_length"]) == 2
    with pytest.raises(ValueError, match="window_length must be one number, or one for each of the 1 records; got 2"):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=first.settings)


def test_a_lag_that_was_found_is_taken_again() -> None:
    late = RIG.angle[3:], RIG.torque[:-3]
    first = tvident.identify(*late, **WHOLE, lag="auto")
    again = tvident.identify(*late, **WHOLE, settings=json.loads(json.dumps(first.settings)))
    np.testing.assert_array_equal(first.stiffness, again.stiffness)
    assert first.constants["inertia"][0] == again.constants["inertia"][0]
    assert again.settings == first.settings
    # What was found is said once, of what found it.
    assert any(line.startswith("the torque is delayed by") for line in first.reasons)
    assert not any(line.startswith("the torque is delayed by") for line in again.reasons)
    own = tvident.identify(*late, **WHOLE, settings=first.settings, lag=0.003)
    assert "lag" not in own.settings["chosen"]
    assert "lag_stderr" not in own.settings
    # At another rate the same seconds are other samples.
    slower = tvident.identify(*(one[::2] for one in late), sample_rate=500, settings=first.settings)
    assert slower.settings["lag"] == first.settings["lag"]


def test_what_is_given_wins_over_settings_and_those_over_the_method() -> None:
    first = tvident.identify(RIG.angle, RIG.torque, **WHOLE, **paper(window_length=151))
    method = tvident.StrongForm(window_length=151, regression_window=300)
    found = tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=first.settings, method=method)
    same(found, tvident.identify(RIG.angle, RIG.torque, **WHOLE, **paper(window_length=151, regression_window=300)))
    chosen = tvident.identify(RIG.angle, RIG.torque, **WHOLE).settings
    plain = tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=chosen, **plain_weak(window_length=81))
    assert "window_length" in chosen["chosen"]
    assert "window_length" not in plain.settings["chosen"]
    known = tvident.identify(RIG.angle, RIG.torque, **WHOLE, method="paper", stiffness=RIG.stiffness)
    with pytest.raises(ValueError, match=r"settings hold no stiffness.*pass stiffness= again"):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=known.settings)
    same(known, tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings=known.settings, stiffness=RIG.stiffness))


def test_nothing_given_is_chosen_from_the_record() -> None:
    default = tvident.identify(RIG.angle, RIG.torque, **WHOLE)
    same(default, tvident.identify(RIG.angle, RIG.torque, **WHOLE, method="auto"))
    same(default, tvident.identify(RIG.angle, RIG.torque, **WHOLE, method=tvident.WeakForm()))
    assert default.settings["method"] == "auto"
    assert default.settings["form"] == "weak"
    assert default.settings["averaging"] is True


def test_the_papers_method_is_the_strong_form_with_everything_windowed() -> None:
    result = tvident.identify(RIG.angle, RIG.torque, **WHOLE, method="paper")
    same(result, tvident.identify(RIG.angle, RIG.torque, **WHOLE, **paper()))
    assert result.settings["kinds"] == dict.fromkeys(("inertia", "damping", "stiffness"), "windowed")
    assert result.settings["window_length"] == 201
    assert result.settings["regression_window"] == 200
    form = tvident.identify(RIG.angle, RIG.torque, **WHOLE, method=tvident.StrongForm()).settings["kinds"]
    assert form == {"inertia": "constant", "damping": "constant", "stiffness": "windowed", "offset": "constant"}


def test_a_known_length_means_windows_of_that_length() -> None:
    assert tvident.WeakForm().averaging is True
    assert tvident.WeakForm(regression_window=400).averaging is False
    assert tvident.WeakForm(regression_window=400, averaging=True).averaging is True
    assert tvident.WeakForm(averaging=False).averaging is False


def test_selection_of_the_strong_form_is_that_of_the_derivatives() -> None:
    for selection in ("window", "pooled", "average"):
        found = tvident.identify(RIG.angle, RIG.torque, **WHOLE, **paper(window_length=101, selection=selection))
        fit = tvident.fit_local_polynomials(RIG.angle, 101, **WHOLE, selection=selection)
        middle = slice(200, -200)
        np.testing.assert_array_equal(found.order[middle], fit.order[middle])
        theta, velocity, acceleration = fit.derivatives[:, 50:-50]
        rows = tvident.rolling_least_squares(np.stack([acceleration, velocity, theta], axis=1), RIG.torque[50:-50], 200)
        np.testing.assert_allclose(found.stiffness[middle], rows.params[150:-150, 2], rtol=1e-9)


def test_forms_are_values() -> None:
    length: Any = np.int64(101)
    assert tvident.WeakForm(window_length=length) == tvident.WeakForm(window_length=101)
    assert tvident.StrongForm() == tvident.StrongForm(window_length=201, regression_window=200)
    with pytest.raises(AttributeError):
        tvident.StrongForm().window_length = 101  # type: ignore[misc]


@pytest.mark.parametrize(
    ("form", "settings", "message"),
    [
        (tvident.StrongForm, {"exponent": 6}, "StrongForm has no option 'exponent'"),
        (tvident.WeakForm, {"max_order": 15}, "WeakForm has no option 'max_order'"),
        (tvident.StrongForm, {"window_length": "auto"}, "window_length must be a number of samples.*got 'auto'.*201"),
        (tvident.StrongForm, {"regression_window": "auto"}, "regression_window must be a number.*200 in the paper"),
        (tvident.StrongForm, {"window_length": 200}, "window_length must be odd.*got 200; use 199 or 201"),
        (tvident.StrongForm, {"window_length": 3}, "window_length must be at least 5; got 3"),
        (tvident.StrongForm, {"window_length": "long"}, "window_length must be samples or a duration .*got 'long'"),
        (tvident.StrongForm, {"max_order": 20}, "max_order must be at most 15; got 20"),
        (tvident.StrongForm, {"criterion": "mdl"}, "criterion must be .* got 'mdl'"),
        (tvident.StrongForm, {"selection": "auto"}, "selection must be 'window', 'pooled' or 'average'; got 'auto'"),
        (tvident.StrongForm, {"filter_torque": 1}, "filter_torque must be True or False; got 1"),
        (tvident.StrongForm, {"variation": "auto"}, "variation must be 'constant' or 'linear'; got 'auto'"),
        (tvident.WeakForm, {"variation": "cubic"}, "variation must be 'auto', 'constant' or 'linear'; got 'cubic'"),
        (tvident.WeakForm, {"averaging": "yes"}, "averaging must be True or False; got 'yes'"),
        (tvident.WeakForm, {"exponent": 21}, "exponent must be between 3 and 20; got 21; use 20"),
        (tvident.WeakForm, {"regression_window": 0.5}, "regression_window must be a whole number; got 0.5"),
    ],
)
def test_settings_are_checked_when_they_are_made(form: Any, settings: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        form(**settings)


def test_settings_are_those_of_a_result() -> None:
    with pytest.raises(TypeError, match="settings must be those of an earlier result"):
        tvident.identify(RIG.angle, RIG.torque, **WHOLE, settings={"kinds": 1})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"preset": "paper"}, "identify has no option 'preset'; use method='auto' or method='paper'"),
        (
            {"window_length": 201},
            "it belongs to a form: use method=tvident.WeakForm(window_length=…) or method=tvident",
        ),
        ({"max_order": 5}, "use method=tvident.StrongForm(max_order=…)"),
        ({"fs": 1000}, "use sample_rate= in Hz"),
        ({"stifness": 0}, "did you mean 'stiffness'?"),
        ({"colour": "blue"}, "it has acceleration, align, angle, "),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_an_option_that_there_is_not_is_told_what_is_right(options: dict[str, Any], words: str) -> None:
    with pytest.raises(TypeError, match=re.escape(words)):
        tvident.identify(np.zeros(100), np.zeros(100), **options)


def test_what_has_no_name_is_told_that_it_needs_one() -> None:
    """It heard "takes 2 positional arguments but 3 were given"."""
    identify: Any = tvident.identify
    given: list[tuple[Any, str]] = [
        (1000, "sample_rate"),
        (np.arange(100) / 1000, "t"),
        (tvident.StrongForm(), "method"),
    ]
    for value, name in given:
        shown = re.escape(arguments.shown(value))
        words = f"identify takes everything but angle and torque by name; got {shown} without one; write {name}= in front of it"
        with pytest.raises(TypeError, match=words):
            identify(np.zeros(100), np.zeros(100), value)


@pytest.mark.parametrize(
    ("form", "options", "words"),
    [
        (
            tvident.WeakForm,
            {"max_order": 3},
            "WeakForm has no option 'max_order'; it belongs to a form: use method=tvident.StrongForm(",
        ),
        (
            tvident.StrongForm,
            {"exponent": 6},
            "StrongForm has no option 'exponent'; it belongs to a form: use method=tvident.WeakForm(",
        ),
        (tvident.StrongForm, {"equations": 200}, "use regression_window= of a form"),
        (tvident.WeakForm, {"windowlength": 33}, "did you mean 'window_length'?"),
    ],
    ids=["strong", "weak", "old", "misspelt"],
)
def test_a_setting_of_the_other_form_is_told_where_it_belongs(form: Any, options: dict[str, Any], words: str) -> None:
    with pytest.raises(TypeError, match=re.escape(words)):
        form(**options)


@pytest.mark.parametrize("method", ["paper", tvident.StrongForm()], ids=["paper", "strong"])
def test_what_varies_slowly_needs_the_weak_form(method: Any) -> None:
    with pytest.raises(
        ValueError, match=r"inertia='varying' needs the weak form; got the strong form; use tvident.WeakForm"
    ):
        tvident.identify(np.zeros(1000), np.zeros(1000), sample_rate=1000, method=method, inertia="varying")
