"""What a recorder holds, or draws in lines, from reading to reading is as good as a channel that has a clock of its own."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import cont2discrete

import tvident
from parameters import long
from tvident import Status
from tvident._clocks.readings import readings_of

Array = npt.NDArray[np.float64]

RATE = 1000.0
INSIDE = slice(500, -500)
STIFFNESS, INERTIA = 1.3, 0.3e-2
"""Error of K(t), over that with an angle at every sample; and of the inertia, which was -100 % off."""
COVERAGE = 0.85
"""Of nominal 95 % intervals of K(t) in one record, whose windows hold some ten independent values."""


def held(channel: Array, hold: int, first: int = 0) -> Array:
    """Return a channel that is read once in `hold` samples, at first at sample `first`."""
    places = np.arange(channel.size)
    return np.asarray(channel[np.maximum((places - first) // hold * hold + first, 0)])


def shown(channel: Array, read: Array) -> Array:
    """Return a channel that shows the latest of what was read at some places, between samples too."""
    samples = np.arange(channel.size)
    last = np.maximum(np.searchsorted(read, samples, side="right") - 1, 0)
    return np.asarray(np.interp(read, samples, channel)[last])


def error(result: tvident.Identification, rig: tvident.Recording) -> float:
    off = (result.stiffness / rig.stiffness - 1)[INSIDE]
    assert np.isfinite(off).all()
    return float(np.sqrt(np.mean(off**2)))


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("hold", "pattern"), [(5, "slider"), (2, "constant"), (2, "slider"), (10, "slider"), (20, "constant")]
)
def test_an_angle_that_is_held_is_taken_from_its_readings(hold: int, pattern: Any) -> None:
    rig = tvident.simulate_torsional_rig(20.0, seed=3, pattern=pattern, angle_noise=1e-3)
    ordinary = tvident.identify(rig.angle, rig.torque, sample_rate=RATE)
    result = tvident.identify(held(rig.angle, hold, first=1), rig.torque, sample_rate=RATE)
    assert error(result, rig) < STIFFNESS * error(ordinary, rig)
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < INERTIA
    covered = np.abs(result.stiffness - rig.stiffness) < 1.96 * result.stderr["stiffness"]
    assert np.mean(covered[INSIDE]) > COVERAGE
    assert result.trusted[INSIDE].all()
    # It is said, for times of readings are only known as well as the recorder tells them.
    assert result.record_status == Status.CHANNEL_SUSPECTED
    assert result.advice[0].startswith(f"the angle holds every value for {hold} samples")
    assert f"as where it was read at {RATE / hold:g} Hz" in result.reasons[0]
    assert "do not trust" not in result.summary()


def test_readings_of_both_channels_at_once_are_those_of_a_slower_recorder() -> None:
    rig = tvident.simulate_torsional_rig(20.0, seed=4, angle_noise=1e-3)
    both = tvident.identify(held(rig.angle, 5), held(rig.torque, 5), sample_rate=RATE)
    slower = tvident.identify(rig.angle[::5], rig.torque[::5], sample_rate=RATE / 5)
    assert both.advice[0].startswith("both channels hold every value for 5 samples")
    assert abs(both.inertia[0] / slower.inertia[0] - 1) < INERTIA
    assert not both.record_status & Status.LAG_SUSPECTED


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("hold", [20, 5])
def test_a_torque_that_comes_late_by_half_of_what_it_holds_was_read(hold: int) -> None:
    """With its steps the inertia was .7 and 11 % off, with the lag that was advised .5 and 3 %."""
    rig = tvident.simulate_torsional_rig(20.0, seed=0, angle_noise=1e-3)
    torque = held(rig.torque, hold)
    result = tvident.identify(rig.angle, torque, sample_rate=RATE)
    assert result.advice[0].startswith(f"the torque holds every value for {hold} samples: splines between readings")
    assert not result.record_status & Status.LAG_SUSPECTED
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < 1.5 * INERTIA
    again = tvident.identify(rig.angle, torque, sample_rate=RATE, settings=json.loads(json.dumps(result.settings)))
    np.testing.assert_array_equal(again.stiffness, result.stiffness)
    assert again.advice == result.advice
    # A stream has no reading to go to.
    with pytest.raises(ValueError, match="torque holds its readings"):
        tvident.IdentificationStream(sample_rate=RATE, settings=result.settings)
    assert np.isfinite(result.simulate(torque)).any()


def test_settings_repeat_what_was_done_to_two_holds_and_gaps() -> None:
    """Settings of gaps hid that the torque was read; and one sentence told both channels of the angle's holds."""
    rig = tvident.simulate_torsional_rig(10.0, seed=3, angle_noise=1e-3)
    angle, torque = held(rig.angle, 5), held(rig.torque, 20)
    angle[3:900:4] = np.nan
    first = tvident.identify(angle, torque, sample_rate=RATE)
    assert first.settings["torque_readings"]
    again = tvident.identify(angle, torque, sample_rate=RATE, settings=json.loads(json.dumps(first.settings)))
    np.testing.assert_array_equal(again.stiffness, first.stiffness)
    assert again.advice == first.advice
    assert again.reasons[0] == first.reasons[0]
    assert again.settings == first.settings
    for name, hold in (("angle", 5), ("torque", 20)):
        assert f"the {name} holds every value for {hold} samples" in first.reasons[0]


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("hold", [5, 2, 10, 20])
def test_a_torque_that_acts_in_steps_stays(hold: int) -> None:
    """It was said to be late by half of what it holds, beside the half sample by which it is early."""
    inertia, damping, stiffness = 0.0123, 0.01, 15.0
    drive = tvident.simulate_torsional_rig(20.0, seed=5).torque
    torque = held(drive, hold)
    rates = np.array([[0.0, 1.0], [-stiffness / inertia, -damping / inertia]])
    step, pushed, *_ = cont2discrete((rates, np.array([[0.0], [1 / inertia]]), np.eye(2), np.zeros((2, 1))), 1 / RATE)
    state, angle = np.zeros(2), np.empty(torque.size)
    for sample, acts in enumerate(torque):
        angle[sample] = state[0]
        state = step @ state + pushed[:, 0] * acts
    # With the lag that is right nothing is left that could say more.
    clean = tvident.identify(angle, torque, sample_rate=RATE, lag=-0.5 / RATE)
    assert all("holds every value" not in advice for advice in clean.advice), clean.advice
    angle += 1e-3 * angle.std() * np.random.default_rng(5).standard_normal(angle.size)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert all("splines between readings" not in advice for advice in result.advice)
    assert abs(result.inertia[0] / inertia - 1) < INERTIA
    assert not result.record_status & Status.CHANNEL_SUSPECTED
    assert all("holds every value" not in advice for advice in result.advice)
    # What acts from one sample to the next acts half a sample later than it is recorded at.
    lag = tvident.identify(angle, torque, sample_rate=RATE, lag="auto").settings["lag"]
    assert lag * RATE == pytest.approx(-0.5, abs=0.05)


@pytest.mark.parametrize("seed", [0, *long(1, 2)])
def test_steps_without_noise_stay_where_splines_are_worse(seed: int) -> None:
    """Steps that are a part of a sample early made splines of them, beside which nothing was known: *I* was 90 to 130 % off."""
    rng = np.random.default_rng(seed)
    inertia, damping, stiffness = 0.02, 0.03, 8.0
    fine, n, hold = 10, 16_000, 38.4
    level = rng.standard_normal(n)
    t = np.arange(n * fine) / (fine * 800.0)
    acts = level[(t * 800.0 / hold).astype(int)]
    rates = np.array([[0.0, 1.0], [-stiffness / inertia, -damping / inertia]])
    step, pushed, *_ = cont2discrete((rates, np.array([[0.0], [1 / inertia]]), np.eye(2), np.zeros((2, 1))), t[1])
    state, angle = np.zeros(2), np.empty(t.size)
    for sample, torque in enumerate(acts):
        angle[sample] = state[0]
        state = step @ state + pushed[:, 0] * torque
    result = tvident.identify(angle[::fine], acts[::fine], sample_rate=800.0)
    assert all("splines between readings" not in advice for advice in result.advice)
    assert abs(result.inertia[0] / inertia - 1) < INERTIA


@pytest.mark.slow
def test_lines_of_an_angle_become_splines() -> None:
    """Lines of 10 samples made the inertia 1.5 % too large, or zero. A torque may act along lines, and stays."""
    rig = tvident.simulate_torsional_rig(20.0, seed=1, angle_noise=1e-3)
    samples = np.arange(rig.angle.size)
    drawn = [np.interp(samples, samples[::10], channel[::10]) for channel in (rig.angle, rig.torque)]
    result = tvident.identify(drawn[0], rig.torque, sample_rate=RATE)
    assert result.advice[0].startswith("the angle lies on straight lines between every 10th sample: splines between")
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < INERTIA
    of_torque = tvident.identify(rig.angle, drawn[1], sample_rate=RATE)
    assert all("splines between readings" not in advice for advice in of_torque.advice)


def _stale(angle: Array) -> None:
    angle[6003] = angle[5990]


def _late(angle: Array) -> None:
    angle[6000:6015] = angle[5999]


def _stuck(angle: Array) -> None:
    angle[2000:3000] = angle[2000]


@pytest.mark.first(2)
@pytest.mark.parametrize("spoil", [_late, _stuck, _stale])
def test_readings_that_are_none_concern_their_neighbours_alone(spoil: Callable[[Array], None]) -> None:
    """Splines through them rang over the whole record, and no number was left."""
    rig = tvident.simulate_torsional_rig(20.0, seed=3, angle_noise=1e-3)
    angle = held(rig.angle, 20)
    spoil(angle)
    result = tvident.identify(angle, rig.torque, sample_rate=RATE)
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < 2 * INERTIA
    assert np.mean(result.trusted) > 0.9


def test_an_angle_that_is_clipped_and_held_lacks_what_is_clipped() -> None:
    rig = tvident.simulate_torsional_rig(20.0, seed=3, angle_noise=1e-3)
    angle = np.clip(held(rig.angle, 5), *(np.array([-1.5, 1.5]) * rig.angle.std()))
    result = tvident.identify(angle, rig.torque, sample_rate=RATE)
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < INERTIA


@pytest.mark.first(1)
@pytest.mark.parametrize("scatter", [0.0, 0.4])
def test_readings_need_not_come_every_so_many_samples(scatter: float) -> None:
    rig = tvident.simulate_torsional_rig(20.0, seed=7, pattern="constant", angle_noise=1e-3)
    steps = 4.17 + scatter * np.random.default_rng(7).uniform(-1, 1, rig.angle.size // 4)
    read = np.cumsum(steps)
    result = tvident.identify(shown(rig.angle, read[read < rig.angle.size - 1]), rig.torque, sample_rate=RATE)
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < INERTIA
    assert abs(result.stiffness[0] / rig.stiffness[0] - 1) < INERTIA
    assert "for 4.17 samples" in result.advice[0]
    assert "give it times of its own" in result.advice[0]
    assert not result.record_status & Status.LAG_SUSPECTED


def test_a_sample_that_is_lost_between_readings_moves_those_that_follow() -> None:
    rig = tvident.simulate_torsional_rig(10.0, seed=6, angle_noise=1e-3)
    angle = np.concatenate([held(rig.angle[:5000], 4), held(rig.angle[5001:], 4)])
    result = tvident.identify(angle, np.delete(rig.torque, 5000), sample_rate=RATE)
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < 2 * INERTIA


def test_the_strong_form_says_what_would_take_its_steps_out() -> None:
    """The paper's method does as it is told: its inertia was late by two samples without a word."""
    rig = tvident.simulate_torsional_rig(5.0, seed=8, angle_noise=1e-3)
    result = tvident.identify(held(rig.angle, 5), rig.torque, sample_rate=RATE, method="paper")
    assert result.advice[0].startswith("the angle holds every value for 5 samples")
    assert "use method='auto'" in result.advice[0]


def test_an_angle_that_was_rounded_is_not_held() -> None:
    """Where it turns steadily a coarse angle changes as regularly as one that is held: by one step at a time."""
    turns, noise = np.arange(20_000) * 0.24, np.random.default_rng(1).standard_normal(20_000)
    for spread in (0.0, 0.1, 0.5):
        assert readings_of(np.round(turns + spread * noise)) is None
    assert readings_of(np.round(turns[:4] * 0.24)) is None
    assert readings_of(np.zeros(20_000)) is None
    # Nor is one that wraps at no multiple of its step, or was written with few digits.
    assert readings_of(np.unwrap(np.round(np.mod(turns / 100, 2 * np.pi), 2))) is None
    assert readings_of(np.round(np.round(turns) * 0.00157, 3)) is None


@pytest.mark.slow
def test_held_angles_with_missing_readings_and_of_several_records() -> None:
    rig = tvident.simulate_torsional_rig(10.0, seed=6, angle_noise=1e-3)
    angle, torque = held(rig.angle, 4), rig.torque.copy()
    angle[4000:4200], torque[30::60] = np.nan, np.nan
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < 2 * INERTIA
    assert (result.status[4000:4200] != 0).all()
    for words in ("go from reading to reading", "bridged by splines"):
        assert words in result.reasons[0]
    several = tvident.identify(np.stack([angle, angle]), np.stack([torque, torque]), sample_rate=RATE)
    np.testing.assert_array_equal(several.stiffness[1], result.stiffness)
    # Records that were read at other times are left as they are.
    other = held(rig.angle, 5)
    apart = tvident.identify(
        np.stack([held(rig.angle, 4), other]), np.stack([rig.torque, rig.torque]), sample_rate=RATE
    )
    assert (apart.record_status & Status.CHANNEL_SUSPECTED != 0).all()
