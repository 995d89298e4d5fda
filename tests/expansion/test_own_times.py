"""Schedules of records whose times are not uniform, or whose angle and torque have clocks of their own."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import make_interp_spline

import tvident

Array = npt.NDArray[np.float64]

DURATION = 12.0


@cache
def true(seed: int) -> tuple[Any, Any, Any]:
    """Give the angle, the torque and the slider's position of a rig at any time; its stiffness is 6 over the position."""
    rig = tvident.simulate_torsional_rig(
        duration=DURATION + 1, sample_rate=2000, seed=seed, torque_snr_db=200, angle_noise=0
    )
    angle, torque, position = (
        make_interp_spline(rig.time, one, k=5) for one in (rig.true_angle, rig.true_torque, rig.slider_position)
    )
    return angle, torque, position


def noisy(values: Array, part: float, seed: int) -> Array:
    return np.asarray(values + part * values.std() * np.random.default_rng(seed).standard_normal(values.size))


def errors(result: tvident.Identification, seed: int) -> tuple[float, float]:
    """Give the relative error of the stiffness, and the largest in standard errors."""
    told, stiffness = result.trusted, 6 / true(seed)[2](result.time)
    off = (result.stiffness - stiffness)[told]
    return (
        float(np.sqrt(np.mean((off / stiffness[told]) ** 2))),
        float(np.max(np.abs(off) / result.stderr["stiffness"][told])),
    )


def check_schedule(t: Array) -> tvident.Identification:
    """Check the stiffness as a schedule of a channel at some times, and give the result."""
    angle, torque, position = (one(t) for one in true(1))
    schedule = tvident.Expansion("bspline", of=position)
    result = tvident.identify(noisy(angle, 1e-3, 2), noisy(torque, 1e-2, 3), t=t, stiffness=schedule)
    error, beyond = errors(result, 1)
    assert error < 2e-3
    assert beyond < 4
    return result


@pytest.mark.parametrize("jitter", [0.2, 0.5, 1.0])
def test_a_schedule_at_times_that_wander_is_that_of_their_samples(jitter: float) -> None:
    steps = 1 + jitter * np.random.default_rng(1).uniform(-0.5, 0.5, int(500 * DURATION))
    check_schedule(np.cumsum(steps) / 500)


def test_a_schedule_goes_over_times_that_are_missing() -> None:
    t = np.arange(int(500 * DURATION)) / 500
    result = check_schedule(np.delete(t, slice(2000, 2200)))
    assert result.trusted.mean() > 0.9


@pytest.mark.parametrize("of", ["angle", "torque"])
@pytest.mark.parametrize("rate", [100.0, 300.0, 1000.0, 4000.0])
def test_a_schedule_has_the_clock_of_the_angle_or_of_the_torque(rate: float, of: str) -> None:
    ours, theirs = (np.arange(int(one * DURATION)) / one for one in (400.0, rate))
    angle, torque = true(4)[0](ours), true(4)[1](theirs)
    schedule = tvident.Expansion("bspline", of=true(4)[2](ours if of == "angle" else theirs))
    result = tvident.identify(
        noisy(angle, 1e-3, 5), noisy(torque, 1e-2, 6), sample_rate=(400.0, rate), stiffness=schedule
    )
    error, beyond = errors(result, 4)
    assert error < 2e-3
    assert beyond < 4
    assert not tvident.Status.NOISE_MODEL & int(result.record_status)
    assert result.settings["sample_rate"] == pytest.approx(400.0)


def test_a_stiffness_that_is_known_may_have_the_clock_of_the_angle() -> None:
    ours, theirs = (np.arange(int(one * DURATION)) / one for one in (400.0, 1000.0))
    angle, torque = noisy(true(4)[0](ours), 1e-3, 5), noisy(true(4)[1](theirs), 1e-2, 6)
    result = tvident.identify(angle, torque, sample_rate=(400.0, 1000.0), stiffness=6 / true(4)[2](ours))
    value, error = result.constants["inertia"]
    assert abs(value - 0.0123) < 4 * error < 0.0004


def moving(seed: int) -> tuple[Any, Any, Any]:
    """Give the angle, the torque and the position of a slider that moves fast, so that stamps that are late tell."""
    rig = tvident.simulate_torsional_rig(
        duration=DURATION + 1,
        sample_rate=2000,
        seed=seed,
        pattern=lambda t: 0.5 + 0.3 * np.sin(4 * t),
        torque_snr_db=200,
        angle_noise=0,
    )
    angle, torque, position = (
        make_interp_spline(rig.time, one, k=5) for one in (rig.true_angle, rig.true_torque, rig.slider_position)
    )
    return angle, torque, position


@pytest.mark.parametrize("of", ["angle", "torque"])
@pytest.mark.parametrize("by", ["seconds", "settings"])
def test_a_schedule_is_as_late_as_the_clock_that_it_has(by: str, of: str) -> None:
    ours, theirs = (np.arange(int(one * DURATION)) / one for one in (400.0, 1000.0))
    angle, torque, position = moving(71000)
    channels = noisy(angle(ours), 1e-3, 1), noisy(torque(theirs), 1e-2, 2)
    times = ours, theirs + 0.1
    schedule = tvident.Expansion("bspline", of=position(ours if of == "angle" else theirs))
    aligned: dict[str, Any] = {"align": 0.1}
    if by == "settings":
        windows = tvident.identify(*channels, t=times, align="offset", inertia="constant", damping="constant")
        aligned = {"settings": windows.settings}
    result = tvident.identify(*channels, t=times, stiffness=schedule, **aligned)
    told, stiffness = result.trusted, 6 / position(result.time)
    assert told.mean() > 0.97
    assert np.abs(result.stiffness / stiffness - 1)[told].max() < 2e-3


def test_an_alignment_that_is_to_be_found_is_refused_beside_what_depends_on_it() -> None:
    ours, theirs = (np.arange(int(one * DURATION)) / one for one in (400.0, 1000.0))
    angle, torque, position = (one for one in true(4))
    channels = angle(ours), torque(theirs)
    for known in (tvident.Expansion("bspline", of=position(theirs)), 6 / position(theirs)):
        with pytest.raises(ValueError, match="what is known at every sample of the torque needs times that are right"):
            tvident.identify(*channels, t=(ours, theirs), align="offset", stiffness=known)
    with pytest.raises(ValueError, match="align must be seconds beside an Expansion"):
        tvident.identify(
            *channels, t=(ours, theirs), align="drift", stiffness=tvident.Expansion("bspline", of=position(ours))
        )
