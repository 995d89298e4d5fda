"""Recordings that lost samples, jitter, or have a slower torque tell what the whole recordings tell."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import make_interp_spline

import tvident
from identify.test_real_recordings import FRICTION, carriage, recording
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

OF_CARRIAGE: dict[str, Any] = {name: value for name, value in FRICTION.items() if name != "sample_rate"} | {
    "inertia": "constant",
    "damping": "constant",
    "angle_unit": "m",
    "torque_unit": "N",
}
"""How the carriage is identified, whatever its times are."""

LOSSES = [(0.01, 1), (0.1, 1), (0.05, 50), (0.1, 200)]
"""Share of the samples, and how many in a row."""


def lost(samples: int, share: float, burst: int, seed: int) -> npt.NDArray[np.bool_]:
    gone = np.zeros(samples, bool)
    for first in np.random.default_rng(seed).integers(0, samples - burst, round(share * samples / burst)):
        gone[first : first + burst] = True
    return gone


def variants(t: Array, angle: Array, torque: Array, loss: tuple[float, int], seed: int) -> list[dict[str, Any]]:
    """Give calls of a recording that lost samples: as NaN in both channels, in each its own, or not there at all."""
    gone, other = (lost(t.size, *loss, each) for each in (seed, seed + 100))
    missing = np.where(gone, np.nan, angle)
    return [
        {"angle": missing, "torque": np.where(gone, np.nan, torque), "sample_rate": 1000},
        {"angle": missing, "torque": np.where(other, np.nan, torque), "sample_rate": 1000},
        {"angle": angle[~gone], "torque": torque[~gone], "t": t[~gone]},
    ]


@cache
def rig(seed: int) -> tuple[tvident.SimulatedRecording, tvident.Identification]:
    simulated = tvident.simulate_torsional_rig(duration=20.0, seed=seed, pattern="slider")
    return simulated, tvident.identify(simulated.angle, simulated.torque, sample_rate=1000)


def error(result: tvident.Identification, simulated: tvident.SimulatedRecording) -> tuple[float, float]:
    """Give the root mean square error of the stiffness where it is known, and how often it is within its 95 % interval."""
    truth = np.interp(result.time, simulated.time, simulated.stiffness)
    away, known = result.stiffness - truth, result.trusted & np.isfinite(result.stiffness)
    inside = np.abs(away[known]) < 1.96 * result.stderr["stiffness"][known]
    return float(np.sqrt(np.mean(away[known] ** 2))), float(inside.mean())


@pytest.mark.first(1)
@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("seed", [1, *long(2, 3, 4, 5, 6)])
def test_a_rig_that_lost_samples_is_the_whole_rig(loss: tuple[float, int], seed: int) -> None:
    simulated, whole = rig(seed)
    t, angle, torque = (np.asarray(one) for one in (simulated.time, simulated.angle, simulated.torque))
    of_whole, covered = error(whole, simulated)
    for call in variants(t, angle, torque, loss, seed):
        result = tvident.identify(**call)
        for name, (value, stderr) in result.constants.items():
            # Both have most samples in common.
            assert abs(value - whole.constants[name][0]) < 2 * stderr, name
        away, inside = error(result, simulated)
        assert inside > covered - 0.1
        if loss[1] == 1:
            # On average as large; windows of a single record may be chosen 20 % shorter.
            assert away < 1.5 * of_whole
            assert result.trusted.mean() > 0.98


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("seed", [1, *long(2, 3)])
@pytest.mark.parametrize("more", [["viscous_asymmetric"], *long([])], ids=str)
def test_a_carriage_that_lost_samples_is_the_whole_carriage(
    folder_of_recordings: Path, more: list[str], loss: tuple[float, int], seed: int
) -> None:
    position, force = carriage(folder_of_recordings)
    t = np.arange(position.size) / 1000
    asked = OF_CARRIAGE | {"terms": [*OF_CARRIAGE["terms"], *more]}
    whole = tvident.identify(position, force, sample_rate=1000, **asked)
    for call in variants(t, position, force, loss, seed):
        result = tvident.identify(**call, **asked)
        for name, (value, stderr) in result.constants.items():
            assert abs(value - whole.constants[name][0]) < 2 * stderr, name
            # Its friction differs between the directions: without that, errors hold what it changes, more where one direction lost more.
            assert not more or stderr < 1.5 * whole.constants[name][1], name


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, *long(2)])
def test_a_carriage_whose_times_are_shuffled_or_whose_force_is_slower_is_the_same(
    folder_of_recordings: Path, seed: int
) -> None:
    position, force = carriage(folder_of_recordings)
    t = np.arange(position.size) / 1000
    whole = tvident.identify(position, force, sample_rate=1000, **OF_CARRIAGE)
    moved = t + 0.3e-3 * np.random.default_rng(seed).uniform(-1, 1, t.size)
    moved = np.clip(moved, t[0], t[-1])
    calls: list[dict[str, Any]] = [
        {
            "angle": make_interp_spline(t, position, k=5)(moved),
            "torque": make_interp_spline(t, force, k=3)(moved),
            "t": moved,
        },
        {"angle": position, "torque": force, "t": moved},
        *({"angle": position, "torque": force[first::3], "t": (t, t[first::3])} for first in range(3)),
    ]
    for call in calls:
        result = tvident.identify(**call, **OF_CARRIAGE)
        for name, (value, stderr) in result.constants.items():
            assert abs(value - whole.constants[name][0]) < 2 * stderr, name


@pytest.mark.parametrize("step", [1, 7])
def test_what_windows_carry_on_into_a_gap_is_not_trusted(step: int) -> None:
    """All of it was, up to 44 errors off."""
    simulated = tvident.simulate_torsional_rig(20.0, seed=5, pattern="slider", angle_noise=1e-3)
    angle = np.array(simulated.angle)
    gap = slice(8000, 11_000)
    angle[gap] = np.nan
    result = tvident.identify(angle, simulated.torque, sample_rate=1000, step=step)
    reach = result.settings["regression_window"]
    assert reach < 3000
    inside = (result.time >= (8000 + reach) / 1000) & (result.time < (11_000 - reach) / 1000)
    flags = Status.GAP | Status.ILL_CONDITIONED
    assert (result.status[inside] & flags == flags).all()
    assert not result.trusted[inside].any()
    beside = (result.time < 7.9) | (result.time > 11.1)
    assert result.trusted[beside].all()
    (said,) = [line for line in result.advice if "no equation is within a quarter of a window" in line]
    assert "stiffness is carried on there from beside the gap" in said


def test_settings_repeat_a_result_with_lost_samples() -> None:
    simulated, _ = rig(1)
    t, angle, torque = (np.asarray(one) for one in (simulated.time, simulated.angle, simulated.torque))
    call = variants(t, angle, torque, (0.1, 1), 7)[0]
    first = tvident.identify(**call)
    again = tvident.identify(**call, settings=first.settings)
    assert np.array_equal(first.stiffness, again.stiffness, equal_nan=True)
    assert "which were bridged by splines" in first.reasons[0]
    assert first.settings["bridged"] == again.settings["bridged"]


@pytest.mark.parametrize(
    ("name", "scale", "terms", "fine"),
    [
        ("pendulum.csv", 1.0, ["gravity", "coulomb", "offset"], 900.0),
        ("robot_joint.csv", 10.1232, ["coulomb", "offset"], 400.0),
    ],
)
def test_recordings_with_their_own_times_are_their_finely_resampled_selves(
    folder_of_recordings: Path, name: str, scale: float, terms: list[str], fine: float
) -> None:
    columns = np.genfromtxt(recording(folder_of_recordings, name), delimiter=",", skip_header=1).T
    t, angle, torque = columns[0], columns[1], scale * columns[3 if "pendulum" in name else 2]
    kinds: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": 0, "terms": terms}
    own = tvident.identify(angle, torque, t=t, **kinds)
    assert own.settings["times"] == "true"
    grid = np.arange(t[0], t[-1], 1 / fine)
    # The noise of a resampled channel is not white: a test function as long as the recording's own is given.
    width = round(own.settings["window_length"] * fine / own.settings["sample_rate"]) | 1
    resampled = tvident.identify(
        make_interp_spline(t, angle, k=5)(grid),
        make_interp_spline(t, torque, k=3)(grid),
        sample_rate=fine,
        method=tvident.WeakForm(window_length=width, exponent=own.settings["exponent"]),
        **kinds,
    )
    for one, (value, stderr) in own.constants.items():
        assert abs(resampled.constants[one][0] - value) < 2 * stderr, one


@pytest.mark.slow
def test_records_of_a_batch_that_lack_little_are_as_alone() -> None:
    simulated, whole = rig(1)
    angle, torque = np.asarray(simulated.angle), np.asarray(simulated.torque)
    rare = angle.copy()
    rare[7000] = np.nan
    many = variants(np.asarray(simulated.time), angle, torque, (0.1, 1), 7)[0]
    together = tvident.identify(
        np.stack([angle, many["angle"], rare]), np.stack([torque, many["torque"], torque]), sample_rate=1000
    )
    alone = [whole, tvident.identify(**many), tvident.identify(rare, torque, sample_rate=1000)]
    for place in (0, 2):
        assert np.array_equal(together.stiffness[place], alone[place].stiffness, equal_nan=True)
        assert np.array_equal(together.stderr["stiffness"][place], alone[place].stderr["stiffness"], equal_nan=True)
    # What noise becomes where samples are bridged is known of a record alone, or of all.
    for name, (value, stderr) in alone[1].constants.items():
        assert abs(together.constants[name][0][1] - value) < 2 * stderr
    same = tvident.identify(np.stack([many["angle"]] * 2), np.stack([many["torque"]] * 2), sample_rate=1000)
    for place in (0, 1):
        assert np.array_equal(same.stiffness[place], alone[1].stiffness, equal_nan=True)


@pytest.mark.parametrize("share", [0.01, 0.1])
@pytest.mark.parametrize("seed", range(2))
def test_polynomials_of_windows_that_lost_samples_are_fitted_on_what_is_there(share: float, seed: int) -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0, seed=seed)
    angle, torque = np.asarray(rig.angle), np.asarray(rig.torque)
    generator = np.random.default_rng(seed)
    lost = [generator.random(angle.size) < share for _ in range(2)]
    call: dict[str, Any] = {"sample_rate": 1000, "method": "paper"}
    whole = tvident.identify(angle, torque, **call)
    found = tvident.identify(np.where(lost[0], np.nan, angle), np.where(lost[1], np.nan, torque), **call)

    def wrong(result: Any) -> float:
        there = np.abs(result.stiffness / rig.stiffness - 1)[result.trusted]
        return float(np.sqrt(np.mean(there**2)))

    assert np.mean(found.trusted) > 0.98 * np.mean(whole.trusted)
    assert wrong(found) < 1.1 * wrong(whole)
    covered = np.abs(found.stiffness - rig.stiffness) < 1.96 * found.stderr["stiffness"]
    assert np.mean(covered[found.trusted]) > 0.85
    # What is tried in weak form lost hardly a row: a constant stiffness with half of the inertia was advised.
    assert not any("try stiffness='constant'" in line for line in found.advice)


def test_a_gap_changes_no_window_that_it_is_not_in() -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0, seed=3)
    angle, torque = np.asarray(rig.angle), np.asarray(rig.torque)
    gaps = angle.copy()
    gaps[1000] = gaps[3000:3040] = np.nan
    call: dict[str, Any] = {"sample_rate": 1000, "method": "paper"}
    whole, found = tvident.identify(angle, torque, **call), tvident.identify(gaps, torque, **call)
    reach = 100 + 100
    far = np.ones(angle.size, dtype=bool)
    far[1000 - reach : 1000 + reach + 1] = far[3000 - reach : 3040 + reach + 1] = False
    np.testing.assert_allclose(found.stiffness[far], whole.stiffness[far], rtol=1e-9)
    # Over one sample the motion is followed; around a gap of 40 there are no equations.
    np.testing.assert_allclose(found.stiffness[900:1100], whole.stiffness[900:1100], rtol=0.02)
    assert np.isnan(found.stiffness[3015:3025]).all()
    assert (found.status[3015:3025] & tvident.Status.INVALID != 0).all()
