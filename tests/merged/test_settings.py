"""Settings of a result of trials or masses, given to another call."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from merged.simulated import chain, simulated
from parameters import examples

identify: Any = tvident.identify
"""Its type is that of a single record."""

TRIALS: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0}


def assert_alike(found: Any, again: Any) -> None:
    """Rows, windows and kinds are the same.

    Weights are made with parameters of the fit before, from another start, so numbers agree to a small part of a standard error.
    """
    assert again.kinds == found.kinds
    for name in ("window_length", "exponent", "regression_window", "known", "terms"):
        assert again.settings[name] == found.settings[name], name
    for name, values in found.elements.items():
        error = np.nan_to_num(found.stderr[name])
        np.testing.assert_allclose(again.elements[name], values, rtol=1e-9, atol=1e-3 * float(error.max()))


@settings(max_examples=examples(5))
@given(
    seed=st.integers(0, 2**31),
    kinds=st.fixed_dictionaries(
        {
            "inertia": st.sampled_from(["constant", "auto", 0.0123]),
            "damping": st.sampled_from(["constant", "auto"]),
            "stiffness": st.sampled_from(["constant", "windowed", "auto"]),
        }
    ),
    terms=st.sampled_from([None, [], ["offset", "coulomb"], [("offset", "windowed")]]),
    phase=st.booleans(),
)
def test_settings_of_trials_repeat_what_was_found(seed: int, kinds: dict[str, Any], terms: Any, *, phase: bool) -> None:
    trials = simulated(3, 500, lambda t: 15 + 2 * np.sin(9 * t), seed=seed, angle_noise=1e-2)
    options = TRIALS | ({"phase": np.tile(np.arange(500) / 500, (3, 1))} if phase else {})
    found = identify(trials.angle, trials.torque, terms=terms, **kinds, **options)
    # As a file holds them.
    told = json.loads(json.dumps(found.settings))
    again = identify(trials.angle, trials.torque, settings=told, **options)
    assert_alike(found, again)
    assert_alike(found, identify(trials.angle, trials.torque, settings=again.settings, **options))


def test_pairs_of_masses_may_come_one_by_one() -> None:
    pairs = [("base", 0), (0, 1)]
    assert tvident.Chain(masses=2, springs=iter(pairs)).springs == tuple(pairs)  # type: ignore[arg-type]


def test_settings_of_masses_repeat_every_part() -> None:
    record = chain([lambda t: 12 + 0 * t, lambda t: 18 + 3 * np.sin(2 * t)], 3000, seed=2)
    tied = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)], dampers=[("base", 0), (0, 1)])
    apart = {name: tvident.Matrix("diagonal") for name in ("inertia", "damping", "stiffness")}
    alone = record.torque + np.array([[1.0], [-1.0]]) * 18 * (record.angle[1] - record.angle[0])
    for torque, options in (
        (record.torque, {"structure": tied, "stiffness": ["constant", "windowed"]}),
        (record.torque, {"structure": tied, "inertia": {0: 0.02}, "stiffness": "constant", "damping": "constant"}),
        (alone, apart),
    ):
        same: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0}
        if "structure" in options:
            same["structure"] = options["structure"]
        else:
            same |= apart
        found = identify(record.angle, torque, **{**same, **options})
        again = identify(record.angle, torque, **same, settings=found.settings)
        assert_alike(found, again)


def test_what_is_given_overrides_settings() -> None:
    trials = simulated(4, 900, lambda t: 15 + 0 * t, seed=11)
    found = identify(trials.angle, trials.torque, stiffness="constant", **TRIALS)
    given = {"settings": found.settings, **TRIALS}
    again = identify(trials.angle, trials.torque, stiffness="windowed", inertia=0.0123, **given)
    assert again.kinds == found.kinds | {"stiffness": "windowed", "inertia": "known"}
    assert again.settings["window_length"] == found.settings["window_length"]
    other = identify(trials.angle, trials.torque, method=tvident.WeakForm(window_length=41), **given)
    assert other.settings["window_length"] == [41]
    assert other.kinds == found.kinds
    none = identify(trials.angle, trials.torque, terms=[], settings=found.settings | {"kinds": {}}, **TRIALS)
    assert "offset" not in none.kinds
    own = tvident.Term("late", lambda _, angle, velocity: angle**3 + 0 * velocity)
    found = identify(trials.angle, trials.torque, terms=[own, ("offset", "windowed")], **TRIALS)
    with pytest.raises(
        ValueError, match=r"'late' is one of the user's own; .* pass terms= again, with all of late, offset"
    ):
        identify(trials.angle, trials.torque, settings=found.settings, **TRIALS)
    again = identify(trials.angle, trials.torque, settings=found.settings, terms=[own, "offset"], **TRIALS)
    assert again.kinds == found.kinds


def test_settings_of_something_else_are_refused() -> None:
    trials = simulated(3, 900, lambda t: 15 + 0 * t, seed=12)
    found = identify(trials.angle, trials.torque, **TRIALS)
    single = tvident.identify(trials.angle[0], trials.torque[0], sample_rate=1000)
    broken = [found.settings | {"kinds": 3}, found.settings | {"exponent": ["wide"]}, {"form": "weak"}, 7]
    broken.append(found.settings | {"kinds": found.settings["kinds"] | {"damping": "sometimes"}})
    broken.append({name: one for name, one in found.settings.items() if name != "known"})
    broken.append(found.settings | {"windowlength": 3})
    for settings_ in (single.settings, *broken):
        with pytest.raises(
            TypeError, match=r"settings must be those of an earlier result with ensemble_axis= or dof_axis="
        ):
            identify(trials.angle, trials.torque, settings=settings_, **TRIALS)
    with pytest.raises(TypeError, match="settings must be those of one record; got those of trials or masses"):
        tvident.identify(trials.angle[0], trials.torque[0], sample_rate=1000, settings=found.settings)
    with pytest.raises(ValueError, match=r"the same elements; got 'damping', which there is not here"):
        identify(trials.angle, trials.torque, settings=found.settings, sample_rate=1000, dof_axis=0)
