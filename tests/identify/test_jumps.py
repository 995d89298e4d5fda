"""Jumps of the stiffness: found where they are, and nowhere else."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

NEAR = 0.02
"""Seconds by which a jump may be misplaced: a tenth of a cycle, for near zero of the angle a spring tells nothing."""
ERROR = 0.03
"""Error of the stiffness of one recording where it jumps every 4 s, rms over its mean: the median of many is below 0.015."""
INTERIOR = slice(1500, -1500)


def recorded(pattern: Any, *, angle_noise: float = 1e-2, counts: int | None = None, seed: int = 7) -> tvident.Recording:
    return tvident.simulate_torsional_rig(
        20.0,
        seed=seed,
        pattern=pattern,
        torque_snr_db=20.0,
        angle_noise=angle_noise,
        encoder_counts=counts,
    )


def identify(recording: tvident.Recording) -> tvident.Identification:
    return tvident.identify(recording.angle, recording.torque, sample_rate=1000)


def waves(time: Array, phases: Array, amplitude: float) -> list[Array]:
    """Waves of .5 to 12 Hz, and their first two derivatives."""
    frequencies = np.linspace(0.5, 12, phases.size)
    each = [np.exp(1j * (2 * np.pi * f * time + p)) for f, p in zip(frequencies, phases, strict=True)]
    rates = 2j * np.pi * frequencies
    return [amplitude * np.real(sum(rate**k * wave for rate, wave in zip(rates, each, strict=True))) for k in range(3)]


def with_noise(draw: np.random.Generator, channel: Array, part: float) -> Array:
    return np.asarray(channel + part * channel.std() * draw.standard_normal(channel.size))


@pytest.mark.first(1)
@pytest.mark.parametrize("angle_noise", [1e-6, 1e-3, 1e-2, 3e-2, 1e-1])
def test_every_jump_is_found_and_windows_end_there(angle_noise: float) -> None:
    recording = recorded("square", angle_noise=angle_noise)
    result = identify(recording)
    true = recording.time[1:][np.abs(np.diff(recording.stiffness)) > 1]
    np.testing.assert_allclose(result.jumps, true, atol=NEAR)
    error = (result.stiffness - recording.stiffness)[INTERIOR]
    assert np.sqrt(np.mean(error**2)) < ERROR * recording.stiffness.mean()
    assert "jump 4 times, at" in result.summary()
    # Errors hold beside jumps too, where the place of the jump is part of them.
    beside = np.abs(recording.time[:, np.newaxis] - true).min(axis=1) < 0.1
    within = np.abs(result.stiffness - recording.stiffness) < 4 * result.stderr["stiffness"]
    assert within[beside].mean() > 0.95
    assert (result.status & (Status.GAP | Status.INVALID | Status.COLOURED) == 0).all()


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("pattern", ["slider", "ramp", "constant"])
@pytest.mark.parametrize("angle_noise", [*long(1e-6), 1e-2, *long(1e-1)])
def test_none_is_invented(pattern: str, angle_noise: float) -> None:
    for seed in range(3):
        assert identify(recorded(pattern, angle_noise=angle_noise, seed=seed)).jumps == ()


@pytest.mark.long
def test_none_is_invented_where_inertia_and_damping_change() -> None:
    recording = tvident.simulate_torsional_rig(
        40.0,
        angle_noise=1e-6,
        inertia=lambda t: 0.0123 * (1 + 0.3 * np.sin(2 * np.pi * 0.1 * t + 0.5)),
        damping=lambda t: 0.025 * (1 + 0.5 * np.sin(2 * np.pi * 0.07 * t + 1)),
    )
    result = identify(recording)
    assert result.jumps == ()
    assert result.settings["kinds"]["inertia"] == result.settings["kinds"]["damping"] == "varying"


def test_a_jump_between_records_that_are_masked_is_placed_by_what_is_left() -> None:
    recording = recorded("square")
    mask = np.ones(recording.time.size, bool)
    mask[2000:2300] = False
    result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, mask=mask)
    assert len(result.jumps) == 4
    assert (result.status[2100:2200] & Status.GAP != 0).all()


def test_an_encoder_hides_no_jump() -> None:
    recording = recorded("square", counts=1024)
    true = recording.time[1:][np.abs(np.diff(recording.stiffness)) > 1]
    np.testing.assert_allclose(identify(recording).jumps, true, atol=NEAR)


def test_every_record_of_a_batch_has_its_own() -> None:
    both = [recorded(pattern) for pattern in ("square", "constant")]
    angle, torque = (np.stack([getattr(one, name) for one in both]) for name in ("angle", "torque"))
    result = tvident.identify(angle, torque, sample_rate=1000)
    assert [len(jumps) for jumps in result.jumps] == [4, 0]
    alone = identify(both[0])
    assert result.jumps[0] == alone.jumps
    np.testing.assert_array_equal(result.stiffness[0], alone.stiffness)


@pytest.mark.first(1)
@pytest.mark.parametrize("pattern", ["constant", "slider"])
@pytest.mark.parametrize("part", [0.05, *long(0.2, -0.3, 0.5)])
def test_a_jump_of_the_inertia_is_one_of_the_inertia(pattern: Any, part: float) -> None:
    for seed in (0, 3):
        at = 6.3 + 1.7 * seed

        def inertia(t: Array, at: float = at) -> Array:
            return np.asarray(0.0123 * (1 + part * (t >= at)))

        recording = tvident.simulate_torsional_rig(20.0, seed=seed, pattern=pattern, angle_noise=1e-3, inertia=inertia)
        result = identify(recording)
        np.testing.assert_allclose(result.jumps, [at], atol=NEAR)
        assert result.settings["kinds"]["inertia"] == "varying"
        assert result.settings["kinds"]["damping"] == "constant"
        inside = slice(500, -500)
        assert np.sqrt(np.mean((result.inertia / recording.inertia - 1)[inside] ** 2)) < 0.01
        assert not result.record_status & Status.KIND_CONTRADICTED


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [20_000, 20_027])
def test_windows_hardly_longer_than_a_narrow_test_function_hide_no_jump(seed: int) -> None:
    # Of 36 such records these two were lost: K was 60 and 108 % off.
    recording = tvident.simulate_torsional_rig(40.0, 1000.0, seed, "square", torque_snr_db=20.0, angle_noise=1e-3)
    found = identify(recording)
    off = (found.stiffness - recording.stiffness)[INTERIOR]
    assert np.sqrt(np.mean(off**2)) < ERROR * recording.stiffness.mean()
    inertia, error = found.constants["inertia"]
    assert abs(inertia - recording.inertia[0]) < 4 * error


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("seed", "duration"), [(7016, 20.25), (7007, 16.25), *long((7001, 16.25), (7009, 20.15), (7013, 20.27))]
)
def test_a_jump_just_before_the_end_loses_nothing_else(seed: int, duration: float) -> None:
    """Nothing was found at all: whether the motion explains the torque was asked with windows that reach over jumps."""
    recording = tvident.simulate_torsional_rig(
        duration, seed=seed, pattern="square", angle_noise=(1e-4, 1e-3, 3e-3)[seed % 3]
    )
    result = identify(recording)
    assert not result.record_status & Status.RANK_DEFICIENT
    off = np.asarray(result.inertia) / recording.inertia - 1
    assert np.median(np.abs(off)) < 0.005
    off = np.asarray(result.stiffness) / recording.stiffness - 1
    assert np.median(np.abs(off)) < 0.005


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_change_within_a_test_function_is_followed(seed: int) -> None:
    """As a jump the stiffness was 4 % off within .1 s of the middle, and 150 samples more than five errors, up to 250."""
    draw, time = np.random.default_rng(seed), np.arange(20_000) / 1000
    angle, velocity, acceleration = waves(time, draw.uniform(0, 6, 40), 0.02)
    later = np.mod(time, 5) - 2.5
    stiffness = 13 + 3 * np.tanh(later / 0.01) * np.where(np.mod(time, 10) < 5, 1, -1)
    torque = 0.0123 * acceleration + 0.03 * velocity + stiffness * angle
    angle, torque = (with_noise(draw, one, part) for one, part in ((angle, 1e-3), (torque, 0.01)))
    result = tvident.identify(angle, torque, sample_rate=1000)
    np.testing.assert_allclose(result.jumps, [2.5, 7.5, 12.5, 17.5], atol=NEAR)
    off = result.stiffness - stiffness
    assert np.sqrt(np.mean((off / stiffness)[np.abs(later) < 0.1] ** 2)) < 0.025
    assert np.count_nonzero(np.abs(off) > 5 * result.stderr["stiffness"]) < 40


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [71601, 71605, 71606, *long(*range(20))])
def test_a_jump_of_the_damping_is_placed_where_it_is(seed: int) -> None:
    """It was placed .13 to .44 s away in every other record, and the damping trusted there, up to 69 errors off."""
    draw, time = np.random.default_rng(seed), np.arange(8000) / 500
    angle, velocity, acceleration = waves(time, draw.uniform(0, 2 * np.pi, 24), 0.01)
    damping = 0.02 * (1 + 0.3 * (time >= 8))
    torque = 0.0123 * acceleration + damping * velocity + 13 * angle
    angle, torque = (with_noise(draw, one, part) for one, part in ((angle, 1e-3), (torque, 0.01)))
    result = tvident.identify(angle, torque, sample_rate=500)
    np.testing.assert_allclose(result.jumps, [8.0], atol=0.06)
    beyond = np.abs(result.damping - damping) > 5 * result.stderr["damping"]
    assert np.count_nonzero(beyond) <= 5


@pytest.mark.first(1)
@pytest.mark.parametrize(("seconds", "seed"), [(40.0, 1), (80.0, 1)])
def test_widths_are_compared_between_the_jumps_that_wider_functions_find(seconds: float, seed: int) -> None:
    """Windows over jumps drew the inertia down with the width: 5 of 9 jumps were found, the inertia 6 % off, and the sensor blamed."""
    recording = tvident.simulate_torsional_rig(seconds, seed=seed, pattern="square", angle_noise=1e-3)
    result = identify(recording)
    true = recording.time[1:][np.abs(np.diff(recording.stiffness)) > 1]
    np.testing.assert_allclose(result.jumps, true, atol=NEAR)
    inertia, error = result.constants["inertia"]
    assert abs(inertia - recording.inertia[0]) < 4 * error < 0.005 * inertia
    assert result.record_status == 0
    assert not result.scan().moved
    again = tvident.identify(recording.angle, recording.torque, sample_rate=1000, settings=result.settings)
    np.testing.assert_array_equal(again.stiffness, result.stiffness)
