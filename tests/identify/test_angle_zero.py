"""The angle at which the spring is relaxed: K(t) (θ - θ₀), where the encoder's zero is another one."""

from __future__ import annotations

import json
from functools import cache
from typing import Any, Literal

import numpy as np
import pytest

import tvident
from tvident import Status

ERRORS = 4.0
"""An estimate may lie so many of its standard errors from the truth: one of 16 000 lies farther by chance."""
WITHIN_INERTIA = 0.003
WITHIN_STIFFNESS = 0.006
"""Required of the slider with 1 % of noise; without a zero its errors are 0.001 and 0.003."""
COVERED = 0.85
"""Part of the samples at which the truth lies within 1.96 errors: 0.95 ± 0.03 for the 20 independent windows of a record."""
SEEDS = range(3)
Pattern = Literal["slider", "square", "constant"]


@cache
def rig(seed: int, pattern: Pattern = "slider") -> tvident.Recording:
    return tvident.simulate_torsional_rig(duration=20.0, seed=seed, pattern=pattern, angle_noise=1e-2)


def identified(seed: int, zero: float, pattern: Pattern = "slider", **more: Any) -> tvident.Identification:
    """Identify a record whose encoder reads so many root mean squares of the angle where the spring is relaxed."""
    record = rig(seed, pattern)
    found: tvident.Identification = tvident.identify(
        record.angle + zero * record.angle.std(), record.torque, sample_rate=1000, **more
    )
    return found


@cache
def plainly(seed: int, zero: float) -> tvident.Identification:
    """Identify so, with nothing given."""
    return identified(seed, zero)


def off(result: tvident.Identification, seed: int, zero: float) -> float:
    """Give how far the zero is off, in its standard errors."""
    value, error = result.constants["angle_zero"]
    return float(abs(value - zero * rig(seed).angle.std()) / error)


@pytest.mark.first(1)
@pytest.mark.parametrize("zero", [0.1, -0.3, 3.0])
def test_the_spring_is_relaxed_at_another_angle(zero: float) -> None:
    for seed in SEEDS:
        record, result = rig(seed), plainly(seed, zero)
        inside = slice(500, -500)
        assert off(result, seed, zero) < ERRORS
        assert abs(result.inertia[0] / record.inertia[0] - 1) < WITHIN_INERTIA
        wrong = result.stiffness[inside] - record.stiffness[inside]
        assert np.sqrt(np.mean(wrong**2)) < WITHIN_STIFFNESS * record.stiffness.mean()
        assert np.mean(abs(wrong) < 1.96 * result.stderr["stiffness"][inside]) > COVERED
        assert not result.record_status & (Status.KIND_CONTRADICTED | Status.NOISE_MODEL | Status.SCALES_DISAGREE)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("seed", SEEDS)
def test_few_rows_of_many_lead_to_the_same_zero(seed: int) -> None:
    """With little noise test functions are narrow and rows many, of which few compare windows while an angle is only tried."""
    record = tvident.simulate_torsional_rig(20.0, seed=seed, pattern="slider", angle_noise=1e-5, torque_snr_db=60.0)
    result = tvident.identify(record.angle + 0.3, record.torque, sample_rate=1000)
    value, error = result.constants["angle_zero"]
    assert abs(value - 0.3) < ERRORS * error
    inertia = result.value("inertia")
    assert abs(inertia.value - record.inertia[0]) < ERRORS * inertia.stderr
    assert result.record_status == 0


@pytest.mark.first(1)
@pytest.mark.parametrize(("seed", "damping"), [(130, 0.00825), (204, 0.025)])
def test_windows_that_are_chosen_again_leave_a_part_of_an_error_and_do_not_end_the_search(
    seed: int, damping: float
) -> None:
    record = tvident.simulate_torsional_rig(20.0, seed=seed, pattern="slider", angle_noise=1e-3, damping=damping)
    zero = 3.0 * record.angle.std()
    result = tvident.identify(record.angle + zero, record.torque, sample_rate=1000)
    value, error = result.constants["angle_zero"]
    assert abs(value - zero) < ERRORS * error
    assert abs(result.inertia[0] / record.inertia[0] - 1) < WITHIN_INERTIA
    assert result.record_status == 0


def test_the_size_of_the_zero_changes_nothing_else() -> None:
    small, large = plainly(0, 0.1), plainly(0, 3.0)
    # Both are found by steps that end at a fiftieth of an error.
    assert np.allclose(small.stiffness, large.stiffness, rtol=0, atol=0.02 * np.nanmax(small.stderr["stiffness"]))


@pytest.mark.slow
def test_words_table_and_settings_tell_of_it() -> None:
    result = identified(1, 0.5)
    assert any("the spring is relaxed at" in reason for reason in result.reasons)
    assert "angle_zero" in result.summary()
    settings = json.loads(json.dumps(result.settings))
    assert settings["angle_zero"] == pytest.approx(result.constants["angle_zero"][0])
    again = identified(1, 0.5, settings=settings)
    assert again.constants["angle_zero"][0] == pytest.approx(
        settings["angle_zero"], abs=0.05 * again.constants["angle_zero"][1]
    )
    settings.pop("angle_zero")
    assert off(identified(1, 0.5, settings=settings), 1, 0.5) < ERRORS


def test_a_response_knows_of_it() -> None:
    result = identified(0, 1.0)
    # The angle's noise of 1 % is 0.01 % of its variance.
    assert result.vaf() > 99
    assert result.held_back().simulated > 99


def test_a_batch_has_one_zero_a_record() -> None:
    record = rig(2)
    angles = np.stack([record.angle, record.angle + 0.3 * record.angle.std()])
    result = tvident.identify(angles, np.stack([record.torque] * 2), sample_rate=1000)
    values, errors = result.constants["angle_zero"]
    assert (values[0], errors[0]) == (0.0, 0.0)
    assert abs(values[1] - 0.3 * record.angle.std()) < ERRORS * errors[1]
    assert result.vaf().min() > 99
    assert "angle_zero" not in result[0].constants
    assert result[1].constants["angle_zero"] == (values[1], errors[1])
    assert result[1].settings["angle_zero"] == values[1]


@pytest.mark.slow
def test_it_is_found_beside_jumps_of_the_stiffness() -> None:
    for seed in (0, 1):
        result = identified(seed, -0.5, "square")
        value, error = result.constants["angle_zero"]
        assert abs(value + 0.5 * rig(seed, "square").angle.std()) < ERRORS * error
        assert len(result.jumps) == 4


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("pattern", ["slider", "constant"])
def test_it_is_not_found_where_it_is_not(pattern: Pattern) -> None:
    for seed in SEEDS:
        for offset in (0.0, 0.3):
            record = rig(seed, pattern)
            result = tvident.identify(record.angle, record.torque + offset * record.torque.std(), sample_rate=1000)
            assert "angle_zero" not in result.constants


def test_beside_a_constant_stiffness_it_is_the_offset() -> None:
    result = identified(0, 0.5, "constant")
    assert "angle_zero" not in result.constants
    record = rig(0, "constant")
    assert abs(np.median(result.stiffness) / record.stiffness[0] - 1) < WITHIN_STIFFNESS
    assert result.terms["offset"][0] == pytest.approx(-0.5 * record.angle.std() * record.stiffness[0], rel=0.02)


@pytest.mark.slow
def test_an_offset_that_drifts_is_no_zero_and_is_named() -> None:
    record = rig(0)
    drift = 0.3 * record.torque.std() * np.cos(np.pi * record.time / record.time[-1])
    result = tvident.identify(record.angle, record.torque + drift, sample_rate=1000)
    assert "angle_zero" not in result.constants
    assert result.settings["kinds"]["offset"] == "windowed"
    result = tvident.identify(record.angle, record.torque + drift, sample_rate=1000, terms=[("offset", "constant")])
    assert "angle_zero" not in result.constants
    assert result.record_status & Status.KIND_CONTRADICTED
    assert any("('offset', 'windowed')" in line for line in result.advice)


def test_where_nothing_is_determined_there_is_no_zero_and_settings_repeat_that() -> None:
    # An angle for a torque: another angle at which the spring is relaxed predicts better, but no spring is known.
    record = tvident.simulate_torsional_rig(duration=10.0, seed=6, angle_noise=1e-4)
    result = tvident.identify(
        record.torque, record.angle, sample_rate=1000, inertia="constant", damping="constant", lag=0.0
    )
    assert result.record_status & Status.RANK_DEFICIENT
    assert "angle_zero" not in result.constants
    again = tvident.identify(record.torque, record.angle, sample_rate=1000, settings=result.settings)
    np.testing.assert_array_equal(again.stiffness, result.stiffness)
    assert np.isnan(result.held_back().predicted).all()
