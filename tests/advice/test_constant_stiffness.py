"""Along a sweep a growing damping does what a late torque does: no impossible machine is offered, but a stiffness that need not change."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest

import tvident
from parameters import long
from tvident import Status

RATE = 1000.0


@cache
def sweep(seed: int, growth: float = 0.05) -> Any:
    return tvident.simulate_torsional_rig(
        10.0,
        seed=seed,
        pattern="constant",
        excitation="chirp",
        damping=lambda time: 0.8 * (1 + growth * time),
        torque_snr_db=30,
    )


@cache
def found(seed: int, **kinds: Any) -> Any:
    rig = sweep(seed)
    return tvident.identify(rig.angle, rig.torque, sample_rate=RATE, **kinds)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, *long(0, 1, 3, 4, 5, 7, 8, 9, 11)])
def test_a_growing_damping_is_no_late_torque(seed: int) -> None:
    advice = found(seed).advice
    assert not any(line.startswith("the torque is late") for line in advice)
    assert advice[0].startswith("stiffness need not change: try stiffness='constant'; then ")
    assert "the error of inertia falls from " in advice[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, *long(0, 3, 8, 11)])
def test_what_is_advised_is_right_and_believed(seed: int) -> None:
    rig, result = sweep(seed), found(seed, stiffness="constant")
    assert not result.record_status
    assert not result.advice
    assert result.settings["kinds"] == {
        "inertia": "constant",
        "damping": "varying",
        "stiffness": "constant",
        "offset": "constant",
    }
    for name in ("inertia", "stiffness"):
        one, truth = result.value(name), float(np.median(getattr(rig, name)))
        assert abs(one.value - truth) < min(4 * one.stderr, 0.005 * truth)
    assert np.max(np.abs(result.damping / rig.damping - 1)) < 0.02


def test_what_changes_beside_constants_is_chosen_for_as_if_that_was_given() -> None:
    # The test function was chosen, and its widths were compared, with a constant damping: along a sweep widths disagree then.
    automatic, given = found(2, stiffness="constant"), found(2, stiffness="constant", damping="varying")
    assert automatic.settings["window_length"] == given.settings["window_length"]
    np.testing.assert_array_equal(automatic.damping, given.damping)
    np.testing.assert_array_equal(automatic.inertia, given.inertia)
    rig = sweep(2)
    again = tvident.identify(rig.angle, rig.torque, sample_rate=RATE, settings=automatic.settings)
    np.testing.assert_array_equal(again.damping, automatic.damping)


def test_a_constant_damping_along_a_sweep_says_nothing_of_it() -> None:
    rig = sweep(0, 0.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=RATE)
    assert not any("need not change" in line or "late" in line for line in result.advice)
    assert not result.record_status & Status.LAG_SUSPECTED


def test_a_stiffness_without_any_number_is_no_reason_to_warn() -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0, sample_rate=5000, seed=51003, pattern="constant")
    lost = np.random.default_rng(3).random(rig.angle.size) < 0.1
    angle = np.where(lost, np.nan, rig.angle)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = tvident.identify(angle, rig.torque, sample_rate=5000, nan_policy="propagate")
        assert not result.trusted.any()
        assert "do not trust" in result.summary().splitlines()[0]
