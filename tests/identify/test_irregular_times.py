"""Times that are not uniform: what must not change, what is exact, what noise does, and what is said."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import make_interp_spline

import tvident
from parameters import long
from tvident import Status, _core
from tvident._clocks import Passed

Array = npt.NDArray[np.float64]

RATE = 1000.0
CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}


@cache
def rig(seed: int, duration: float = 8.0) -> tvident.SimulatedRecording:
    return tvident.simulate_torsional_rig(
        duration=duration + 0.02, sample_rate=4 * RATE, seed=seed, pattern="constant", torque_snr_db=200, angle_noise=0
    )


def taken(seed: int, t: Array, noise: tuple[float, float] = (0.0, 0.0), duration: float = 8.0) -> tuple[Array, Array]:
    """Give angle and torque of the rig at some times, with noise of some part of their standard deviations."""
    simulated = rig(seed, duration)
    generator = np.random.default_rng(seed + 1000)
    channels = []
    for channel, part in zip((simulated.true_angle, simulated.true_torque), noise, strict=True):
        values = make_interp_spline(simulated.time, channel, k=7)(t)
        channels.append(values + part * values.std() * generator.standard_normal(t.size))
    return channels[0], channels[1]


def jittered(seed: int, jitter: float, samples: int = 8000) -> Array:
    shift = np.random.default_rng(seed).uniform(-0.5, 0.5, samples)
    return np.sort(np.arange(samples) + 5 + jitter * shift) / RATE


def errors(result: tvident.Identification, seed: int, duration: float = 8.0) -> Array:
    simulated = rig(seed, duration)
    truth = {name: float(getattr(simulated, name)[0]) for name in CONSTANT}
    return np.array([result.constants[name][0] / truth[name] - 1 for name in CONSTANT])


def test_uniform_times_take_the_same_way_bit_for_bit() -> None:
    t = np.arange(4000) / RATE
    angle, torque = taken(0, t, (1e-3, 0.1))
    by_rate = tvident.identify(angle, torque, sample_rate=RATE)
    for times in (t, t + 1e-7 * np.sin(np.arange(t.size)), np.round(t, 3)):
        by_time = tvident.identify(angle, torque, t=times)
        if times is t:
            assert by_time.settings == by_rate.settings
        for name in CONSTANT:
            if by_time.settings["sample_rate"] == by_rate.settings["sample_rate"]:
                assert np.array_equal(getattr(by_time, name), getattr(by_rate, name), equal_nan=True)
        assert "times" not in by_time.settings


@pytest.mark.parametrize("jitter", [0.1, 0.3])
def test_without_noise_jitter_costs_nothing(jitter: float) -> None:
    """As promised: exact to 1e-8 of the uniform record's numbers, up to 0.3 of a step."""
    t = jittered(1, jitter)
    settings = tvident.WeakForm(window_length=161, exponent=8)
    call = {**CONSTANT, "method": settings, "terms": ()}
    result = tvident.identify(*taken(1, t), t=t, **call)
    assert result.settings["times"] == "true"
    assert result.settings["spline_order"] == 5
    np.testing.assert_allclose(errors(result, 1), 0, atol=1e-8)


def test_results_are_at_the_times_of_the_grid_and_settings_repeat_them() -> None:
    t = jittered(2, 0.3) + 100.0
    angle, torque = taken(2, t - 100.0, (1e-3, 0.1))
    result = tvident.identify(angle, torque, t=t)
    assert result.time.size == t.size
    assert result.time[0] == t[0]
    assert result.time[-1] == pytest.approx(t[-1], abs=1e-9)
    np.testing.assert_allclose(np.diff(result.time), 1 / result.settings["sample_rate"], rtol=1e-6)
    assert "steps of time scatter by 0.3 of a step" in result.reasons[0]
    again = tvident.identify(angle, torque, t=t, settings=result.settings)
    assert np.array_equal(again.stiffness, result.stiffness, equal_nan=True)
    assert again.settings["spline_order"] == result.settings["spline_order"]


def test_splines_of_settings_are_taken_and_not_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is said of the splines is said of those that are used."""
    t = jittered(4, 1.0)
    call = {"t": t, "method": tvident.WeakForm(window_length=161, exponent=8), "terms": (), **CONSTANT}
    result = tvident.identify(*taken(4, t, (1e-3, 0.1)), **call)
    other = 3 if result.settings["spline_order"] != 3 else 5
    settings = {**result.settings, "spline_order": other, "bridged": 2.5}

    def looked_for(*_: object) -> NoReturn:
        raise AssertionError("splines were looked for")

    monkeypatch.setattr("tvident._clocks.clock.chosen_order", looked_for)
    monkeypatch.setattr("tvident._clocks.clock.longest_bridged", looked_for)
    again = tvident.identify(*taken(4, t, (1e-3, 0.1)), **{**call, "method": "auto"}, settings=settings)
    assert (again.settings["spline_order"], again.settings["bridged"]) == (other, 2.5)
    assert f"by splines of order {other}" in again.reasons[0]
    assert again.constants != result.constants


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize(("jitter", "noise"), [(0.3, (1e-3, 0.1)), (1.0, (1e-2, 0.1))])
def test_errors_are_those_that_are_told(jitter: float, noise: tuple[float, float]) -> None:
    """Coverage of nominal 95 % intervals over 12 records and 3 constants, which scatters by 3.6 %, and no worse than uniform times."""
    settings: Any = None
    found, told, uniform = [], [], []
    for seed in range(12):
        t = jittered(seed, jitter)
        result = tvident.identify(*taken(seed % 6, t, noise), t=t, settings=settings, **CONSTANT)
        settings = result.settings
        found.append(errors(result, seed % 6))
        told.append([result.constants[name][1] / result.constants[name][0] for name in CONSTANT])
        even = jittered(seed, 0.0)
        by_rate = tvident.identify(*taken(seed % 6, even, noise), sample_rate=RATE, settings=settings, **CONSTANT)
        uniform.append(errors(by_rate, seed % 6))
    inside = np.abs(found) <= 1.96 * np.array(told)
    assert inside.mean() >= 0.95 - 2 * 0.036
    loss = np.sqrt(np.mean(np.square(found)) / np.mean(np.square(uniform)))
    assert loss < 1.3


@pytest.mark.slow
def test_stamps_that_jitter_are_told_from_samples_that_do() -> None:
    even = jittered(3, 0.0)
    stamps = jittered(3, 0.6)
    angle, torque = taken(3, even, (1e-4, 0.05))
    result = tvident.identify(angle, torque, t=stamps, **CONSTANT)
    assert result.settings["times"] == "even"
    assert result.record_status & Status.CHANNEL_SUSPECTED
    assert "the stamps jitter, not the samples" in result.advice[0]
    # Settings say how samples were taken. What is wrong with their times is said again, of this record.
    again = tvident.identify(angle, torque, t=stamps, settings=result.settings)
    assert again.record_status == result.record_status
    assert again.advice[0] == result.advice[0]
    assert again.settings == result.settings
    by_rate = tvident.identify(angle, torque, sample_rate=result.settings["sample_rate"], **CONSTANT)
    assert result.constants == by_rate.constants
    true = tvident.identify(*taken(3, stamps, (1e-4, 0.05)), t=stamps, **CONSTANT)
    other = tvident.identify(angle, torque, t=stamps, settings=true.settings)
    assert other.settings["times"] == "true"
    assert "the earlier result took samples at their times" in other.advice[0]
    assert tvident.Status.CHANNEL_SUSPECTED in other.record_status
    assert true.settings["times"] == "true"
    assert not true.record_status & Status.CHANNEL_SUSPECTED


@pytest.mark.parametrize(("seed", "by"), [(4, 2.0), (7, 1.0), *long((1, 1.0), (6, 2.0))])
def test_stamps_that_jitter_by_more_than_a_step_are_told_by_the_angle(seed: int, by: float) -> None:
    """A torque that is mostly noise says nothing against it; the angle's noise would be a thousand times as large in time."""
    simulated = tvident.simulate_torsional_rig(duration=20.0, seed=100 + seed, pattern="slider")
    stamps = np.sort(simulated.time + by / RATE * np.random.default_rng(seed).uniform(-1, 1, simulated.time.size))
    result = tvident.identify(simulated.angle, simulated.torque, t=stamps)
    assert result.settings["times"] == "even"
    assert tvident.Status.CHANNEL_SUSPECTED in result.record_status
    value, error = result.constants["inertia"]
    assert abs(value - simulated.inertia[0]) < 4 * error


def test_stamps_that_jitter_by_a_whole_step_do_not_change_the_rate() -> None:
    """Steps that splines would not go over, since the motion is no motion in such a time, are no gaps of samples taken evenly."""
    simulated = tvident.simulate_torsional_rig(seed=81)
    generator = np.random.default_rng(101)
    generator.uniform(size=20_000)
    stamps = np.sort(np.arange(20_000) + generator.uniform(-0.5, 0.5, 20_000)) / RATE
    result = tvident.identify(simulated.angle, simulated.torque, t=stamps)
    assert result.settings["times"] == "even"
    # A line through 20 000 stamps that scatter by 0.29 of a step has a slope with an error of 4e-7 of its own.
    assert abs(result.settings["sample_rate"] / RATE - 1) < 5 * 4e-7
    by_rate = tvident.identify(simulated.angle, simulated.torque, sample_rate=result.settings["sample_rate"])
    np.testing.assert_array_equal(result.stiffness, by_rate.stiffness)


def test_a_record_without_long_steps_says_nothing_of_those_of_another() -> None:
    t = jittered(7, 0.3)
    call = {"method": tvident.WeakForm(window_length=161, exponent=8), "terms": (), **CONSTANT}
    whole = tvident.identify(*taken(7, t, (1e-3, 0.1)), t=t, **call)
    assert whole.settings["bridged"] == 1.5
    assert "gaps" not in whole.reasons[0]
    lost = np.random.default_rng(7).random(t.size) > 0.01
    angle, torque = (one[lost] for one in taken(8, t, (1e-3, 0.1)))
    again = tvident.identify(angle, torque, t=t[lost], settings=whole.settings, **{**call, "method": "auto"})
    alone = tvident.identify(angle, torque, t=t[lost], **call)
    assert again.settings["bridged"] == alone.settings["bridged"] > 1.5


def test_only_who_weighs_by_noise_asks_what_a_grid_makes_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes as long as the paper's method, which sees the noise of the grid in its windows."""
    asked: list[Passed] = []

    def noise(passed: Passed) -> _core.PassedNoise:
        asked.append(passed)
        return passed.resampling.passed_noise()

    monkeypatch.setattr(Passed, "noise", property(noise))
    t = jittered(6, 0.3)
    angle, torque = taken(6, t, (1e-3, 0.1))
    paper = tvident.identify(angle, torque, t=t, method="paper")
    assert not asked
    assert np.isfinite(paper.stiffness).any()
    tvident.identify(angle, torque, t=t, **CONSTANT)
    assert asked


@pytest.mark.parametrize("burst", [0, 300])
def test_lost_samples_are_missing_samples(burst: int) -> None:
    t = jittered(4, 0.0)
    kept = np.random.default_rng(4).random(t.size) > 0.1
    kept[3000 : 3000 + burst] = False
    angle, torque = taken(4, t, (1e-3, 0.1))
    result = tvident.identify(angle[kept], torque[kept], t=t[kept], **CONSTANT)
    assert result.settings["times"] == "lost"
    assert "samples are not there" in result.reasons[0]
    assert result.time.size == t.size
    whole = tvident.identify(angle, torque, sample_rate=RATE, **CONSTANT)
    for name in CONSTANT:
        (value, error), (of_all, its_error) = result.constants[name], whole.constants[name]
        assert abs(value - of_all) <= 3 * error
        assert error <= 1.5 * its_error


def test_masks_and_known_parameters_are_brought_along() -> None:
    t = jittered(5, 0.3)
    angle, torque = taken(5, t, (1e-3, 0.1))
    mask = np.ones(t.size, bool)
    mask[4000:] = False
    known = np.full(t.size, float(rig(5).inertia[0]))
    result = tvident.identify(
        np.stack([angle, angle]), np.stack([torque, torque]), t=t, mask=mask, inertia=np.stack([known, known]), step=10
    )
    assert result.stiffness.shape == (2, t.size // 10)
    assert (result.status[:, 450:] != 0).all()
    np.testing.assert_allclose(np.nanmedian(result.stiffness[:, 50:350]), rig(5).stiffness[0], rtol=0.02)


@pytest.mark.parametrize(
    ("place", "by", "message"),
    [
        (50, -0.001, r"t must increase; t\[50\] = .* is that of the sample before; leave one of the two out"),
        (50, -0.0015, r"t must increase; t\[50\] = .* comes after t\[49\] = .*; sort the samples by time"),
        (50, np.nan, r"t must hold finite times; t\[50\] is nan"),
    ],
)
def test_times_that_do_not_increase_say_where(place: int, by: float, message: str) -> None:
    t = np.arange(1000) / RATE
    t[place] = t[49] if by == -0.001 else t[place] + by
    with pytest.raises(ValueError, match=message):
        tvident.identify(np.sin(t), np.sin(t), t=t)


def table(folder: Path, name: str) -> Array:
    path = folder / name
    if not path.exists():
        pytest.skip(f"the recording {name} is missing from {folder}")
    return np.genfromtxt(path, delimiter=",", skip_header=1).T


def test_a_pendulum_with_its_own_times(folder_of_recordings: Path) -> None:
    time, angle, _, torque = table(folder_of_recordings, "pendulum.csv")
    kinds: dict[str, Any] = {
        "inertia": "constant",
        "damping": "constant",
        "stiffness": 0,
        "terms": ["gravity", "coulomb", "offset"],
    }
    result = tvident.identify(angle, torque, t=time, **kinds)
    for name, published in (("inertia", 0.149), ("gravity", 3.0)):
        value, error = result.constants[name]
        assert abs(value - published) <= 3 * error + 0.05 * published


def test_a_robot_joint_with_its_own_times(folder_of_recordings: Path) -> None:
    time, angle, current = table(folder_of_recordings, "robot_joint.csv")[:3]
    kinds: dict[str, Any] = {
        "inertia": "constant",
        "damping": "constant",
        "stiffness": 0,
        "terms": ["coulomb", "offset"],
    }
    result = tvident.identify(angle, 10.1232 * current, t=time, **kinds)
    assert 2.9 <= result.constants["damping"][0] <= 3.3
    assert 2.2 <= result.constants["coulomb"][0] <= 2.6
