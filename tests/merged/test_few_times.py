"""Windows over few times, down to one, that many trials determine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged.simulated import simulated
from parameters import long
from reference import weak_form as reference

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

OPTIONS: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0}


def sine(hertz: float) -> Callable[[Array], Array]:
    return lambda t: np.asarray(15 + 4 * np.sin(2 * np.pi * hertz * t))


def inside(samples: int) -> slice:
    """Give what is not near an end, where windows reach to one side only."""
    return slice(samples // 10, -samples // 10)


@pytest.mark.parametrize("half", [12, 16])
def test_a_window_of_one_sample_is_a_regression_across_trials(half: int) -> None:
    """Windows of less than about 46 samples were refused, however many trials there were."""
    trials = simulated(31, 300, sine(10), seed=half, angle_noise=0.0)
    form = tvident.WeakForm(window_length=2 * half + 1, exponent=8, regression_window=1)
    found = identify(trials.angle, trials.torque, method=form, **OPTIONS)
    assert found.settings["regression_window"] == [1]
    constants = [found.constants[name][0] for name in ("inertia", "damping", "offset")]
    rows = [reference.rows(*one, half, 8, 1e-3) for one in zip(trials.angle, trials.torque, strict=True)]
    column = np.array([A[:, 2] for A, _ in rows])
    left = np.array([b - A[:, :2] @ constants[:2] - constants[2] for A, b in rows])
    expected = np.sum(column * left, axis=0) / np.sum(column**2, axis=0)
    at_rows = found.stiffness[half : half + expected.size * reference.stride_of(half) : reference.stride_of(half)]
    # What is known of the noise of an angle without any is 1e-10 of its variance.
    np.testing.assert_allclose(at_rows[: expected.size], expected, rtol=1e-6)


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4, 5)])
def test_what_many_trials_share_is_followed_within_a_test_function(seed: int) -> None:
    """Windows that leave a test function out on either side of what they predict were 2 to 6 times as far off."""
    trials = simulated(50, 500, sine(8), seed=seed)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    assert found.settings["regression_window"][0] < found.settings["window_length"][0]
    off, error = ((one)[inside(500)] for one in (found.stiffness - trials.stiffness, found.stderr["stiffness"]))
    # Seeds 1 to 12: .0042 to .0051; .011 to .015 with windows of 46 samples.
    assert np.sqrt(np.mean(off**2)) / 15 < 0.007
    assert np.mean(np.abs(off) < 1.96 * error) > 0.9
    value, stderr = found.constants["inertia"]
    assert abs(value - trials.inertia) < 4 * stderr


@pytest.mark.parametrize("seed", [3, *long(4, 5)])
def test_errors_hold_a_step_that_is_blurred(seed: int) -> None:
    """Where no jump was found, one mean over the record stood for what is blurred at its edge: 10 to 12 errors."""
    trials = simulated(50, 500, lambda t: np.where(t < 0.2465, 12.0, 15.0) + np.sin(8 * np.pi * t), seed=seed)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    off = np.abs(found.stiffness - trials.stiffness) / found.stderr["stiffness"]
    assert np.max(off[inside(500)]) < 5


def test_what_does_not_change_is_not_estimated_from_few_times() -> None:
    trials = simulated(50, 500, lambda t: 15 + 0 * t, seed=7)
    found = identify(trials.angle, trials.torque, stiffness="windowed", **OPTIONS)
    assert found.settings["regression_window"][0] > found.settings["window_length"][0]


def test_samples_missing_in_all_trials_are_carried_on_and_cost_nobody_else() -> None:
    trials = simulated(40, 500, sine(8), seed=3)
    angle = trials.angle.copy()
    angle[:, 240:260] = np.nan
    found = identify(angle, trials.torque, nan_policy="omit", **OPTIONS)
    whole = identify(trials.angle, trials.torque, **OPTIONS)
    length = found.settings["window_length"][0]
    far = (np.abs(np.arange(500) - 250) > 3 * length)[inside(500)]
    scale = np.mean(whole.stderr["stiffness"])
    assert np.max(np.abs(found.stiffness - whole.stiffness)[inside(500)][far]) < 3 * scale
    assert not found.trusted[245:255].any()


@pytest.mark.parametrize("scale", ["one", "any"])
def test_trials_that_move_alike_keep_long_windows(scale: str) -> None:
    """At one time they tell a stiffness apart from nothing: numbers were NaN, or 271 % off and trusted."""
    generator = np.random.default_rng(4)
    one = simulated(1, 500, sine(2), seed=3, angle_noise=0.0)
    factors = np.ones((20, 1)) if scale == "one" else generator.normal(size=(20, 1))
    angle = factors * one.angle
    angle += 1e-3 * np.std(one.angle) * generator.standard_normal(angle.shape)
    found = identify(
        angle, factors * one.torque, stiffness="windowed", inertia="constant", damping="constant", **OPTIONS
    )
    off, error = (values[inside(500)] for values in (found.stiffness - one.stiffness, found.stderr["stiffness"]))
    assert np.sqrt(np.mean(off**2)) / 15 < 0.05
    assert np.mean(np.abs(off) < 1.96 * error) > 0.9


def test_windows_over_few_times_need_many_trials() -> None:
    trials = simulated(4, 500, sine(8), seed=3)
    with pytest.raises(ValueError, match="regression_window must be at least about"):
        identify(trials.angle, trials.torque, method=tvident.WeakForm(regression_window=1), **OPTIONS)


def test_settings_of_few_times_are_repeated() -> None:
    trials = simulated(50, 500, sine(8), seed=2)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    again = identify(trials.angle, trials.torque, settings=found.settings, **OPTIONS)
    np.testing.assert_allclose(again.stiffness, found.stiffness, rtol=1e-9)
