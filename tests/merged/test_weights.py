"""Weights of the samples of trials and masses."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

import tvident
from merged.simulated import chain, noisy, simulated
from parameters import examples, long
from reference import merged as reference

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

OPTIONS: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0}
CONSTANT = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")


@settings(max_examples=examples(8))
@given(
    seed=st.integers(0, 2**31),
    lengths=st.lists(st.integers(300, 700), min_size=1, max_size=3),
    half=st.integers(12, 25),
    factor=st.floats(0.1, 10),
)
def test_constants_are_those_of_weighted_rows(seed: int, lengths: list[int], half: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    each = [
        simulated(1, samples, lambda t: 15 + 0 * t, seed=int(rng.integers(2**31)), angle_noise=1e-2)
        for samples in lengths
    ]
    weights = [np.repeat(rng.uniform(0.1, 3, samples // 50 + 1), 50)[:samples] for samples in lengths]
    found = identify(
        [one.angle[0] for one in each],
        [one.torque[0] for one in each],
        method=tvident.WeakForm(window_length=2 * half + 1, exponent=8),
        weights=[factor * one for one in weights],
        **CONSTANT,
        **OPTIONS,
    )
    elements: list[list[reference.Entry]] = [[(0, place, 0, 1.0)] for place in range(3)]
    elements.append([(0, None, 0, 1.0)])
    mean = np.concatenate(weights).mean()
    expected = reference.constants(
        [(one.angle, one.torque) for one in each],
        elements,
        (half, 8),
        1e-3,
        found.settings["noise"][0],
        weights=[one / mean for one in weights],
    )
    errors = np.array([found.constants[name][1] for name in (*CONSTANT, "offset")])
    # As without weights: rounding times the square of a condition number of 1e3.
    np.testing.assert_allclose(
        [found.constants[name][0] for name in (*CONSTANT, "offset")],
        expected,
        rtol=1e-8,
        atol=float(1e-6 * errors.max()),
    )


def in_parts(seed: int, trials: int = 6) -> tuple[Any, Array, Array]:
    """Give trials of which half of each, or whole ones, have ten times the noise, with torques and weights."""
    clean = simulated(trials, 1500, lambda t: 15 + 3 * np.sin(6 * t), seed=seed)
    rng = np.random.default_rng(seed + 1000)
    loud = np.zeros(clean.torque.shape, bool)
    loud[0], loud[1:, 400:900] = True, True
    torque = clean.torque + np.where(loud, 10, 0) * 0.1 * clean.torque.std() * rng.standard_normal(loud.shape)
    return clean, torque, np.where(loud, 1 / 101, 1.0)


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
def test_what_is_noisier_counts_less(seed: int) -> None:
    clean, torque, weights = in_parts(seed)
    weighted, plain = (identify(clean.angle, torque, weights=one, **OPTIONS) for one in (weights, None))
    # Seeds 1 to 12: .14 beside .25 N m/rad; the least gain is from .16 to .13.
    errors = [np.sqrt(np.nanmean((one.stiffness - clean.stiffness) ** 2)) for one in (weighted, plain)]
    assert errors[0] < 0.9 * errors[1]
    assert not weighted.record_status & tvident.Status.NOISE_MODEL
    value, error = weighted.constants["inertia"]
    assert abs(value - clean.inertia) < 4 * error


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
def test_errors_are_those_of_noise_that_differs_from_trial_to_trial(seed: int) -> None:
    clean = simulated(6, 1500, lambda t: 15 + 3 * np.sin(6 * t), seed=seed)
    weights, torque = np.ones(clean.torque.shape), clean.torque.copy()
    weights[:3], torque[:3] = 1 / 101, noisy(np.random.default_rng(seed + 1000), clean.torque[:3], 1.0)
    found = identify(clean.angle, torque, weights=weights, **OPTIONS)
    # Seeds 1 to 12: .89 to 1.00, the mean .954.
    assert np.mean(np.abs(found.stiffness - clean.stiffness) < 1.96 * found.stderr["stiffness"]) > 0.8
    alone = identify(clean.angle[3:], torque[3:], **OPTIONS)
    # Three that are quiet know all but a hundredth of it.
    assert found.constants["inertia"][1] < 1.02 * alone.constants["inertia"][1]
    off = [np.sqrt(np.mean((one.stiffness - clean.stiffness) ** 2)) for one in (found, alone)]
    assert off[0] < 1.2 * off[1]


def test_trials_of_one_have_the_weights_of_a_record() -> None:
    clean = simulated(1, 5000, lambda t: 15 + 3 * np.sin(6 * t), seed=8)
    loud = np.arange(5000) // 500 % 3 == 1
    torque = np.where(loud, noisy(np.random.default_rng(9), clean.torque, 1.0), clean.torque)
    weights = np.where(loud, 1 / 101, 1.0)
    form = tvident.WeakForm(window_length=47, exponent=9)
    found = identify(clean.angle, torque, weights=weights, method=form, **OPTIONS)
    record = identify(clean.angle[0], torque[0], weights=weights, method=form, sample_rate=1000)
    both = record.trusted & (found.status == 0)
    assert both.mean() > 0.9
    differ = np.abs(found.stiffness - record.stiffness)[both] / record.stderr["stiffness"][both]
    assert np.median(differ) < 0.1


def test_a_factor_of_all_weights_and_weights_that_are_alike_change_nothing() -> None:
    clean, torque, weights = in_parts(5, trials=3)
    one, other = (identify(clean.angle, torque, weights=factor * weights, **OPTIONS) for factor in (1.0, 7.0))
    np.testing.assert_allclose(one.stiffness, other.stiffness, rtol=1e-9)
    np.testing.assert_allclose(one.stderr["stiffness"], other.stderr["stiffness"], rtol=1e-7)
    plain = identify(clean.angle, torque, **OPTIONS)
    alike = identify(clean.angle, torque, weights=np.full(1500, 3.0), **OPTIONS)
    np.testing.assert_array_equal(plain.stiffness, alike.stiffness)


def test_samples_of_weight_zero_are_missing() -> None:
    clean, torque, _ = in_parts(6, trials=3)
    weights = np.ones(torque.shape)
    weights[0], weights[1, 700:720] = 0, 0
    wrong = np.where(weights > 0, torque, np.inf)
    missing = np.where(weights > 0, torque, np.nan)
    found = identify(clean.angle, wrong, weights=weights, nan_policy="raise", **OPTIONS)
    expected = identify(np.where(weights > 0, clean.angle, np.nan), missing, **OPTIONS)
    np.testing.assert_array_equal(found.stiffness, expected.stiffness)
    masked = np.ma.array(np.ones(torque.shape), mask=weights == 0)
    np.testing.assert_array_equal(found.stiffness, identify(clean.angle, missing, weights=masked, **OPTIONS).stiffness)


@pytest.mark.first(1)
@pytest.mark.parametrize("structure", [True, False])
def test_weights_of_masses(*, structure: bool) -> None:
    # A spring and dampers of a chain of two, the torques ten times as noisy in half of the record.
    springs = [lambda t: 12 + 0 * t, lambda t: 18 + 0 * t]
    record = chain(springs, 6000, seed=3)
    loud = np.arange(6000) > 3000
    rng = np.random.default_rng(4)
    torque = np.where(loud, noisy(rng, record.torque, 1.0), record.torque)
    options: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0}
    if structure:
        options["structure"] = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)], dampers=[("base", 0), (0, 1)])
    names = ["stiffness_0_1"] if structure else ["stiffness_1_1"]
    plain = identify(record.angle, torque, **CONSTANT, **options)
    found = identify(record.angle, torque, weights=np.where(loud, 1 / 101, 1.0), **CONSTANT, **options)
    for name in names:
        value, error = found.constants[name]
        assert abs(value - 18) < 4 * error
        assert error < 0.8 * plain.constants[name][1]


def at_own_times(seed: int, jitter: float, trials: int = 6) -> tuple[Any, Array, Array, Array, Array]:
    """Give a rig, times that jitter, and angles, torques and weights of trials of which some or parts have ten times the noise."""
    rng, samples = np.random.default_rng(seed), 1500
    times = np.sort(np.arange(samples) + 5 + jitter * rng.uniform(-0.5, 0.5, samples)) / 1000
    loud = np.zeros((trials, samples), bool)
    loud[0], loud[1:, 400:900] = True, True
    angles, torques = np.empty(loud.shape), np.empty(loud.shape)
    for trial in range(trials):
        rig = tvident.simulate_torsional_rig(
            1.52, sample_rate=4000, seed=100 * seed + trial, pattern="constant", torque_snr_db=200, angle_noise=0
        )
        for found, channel, level in ((angles, rig.true_angle, 1e-3), (torques, rig.true_torque, 3e-2)):
            values = make_interp_spline(rig.time, channel, k=7)(times)
            deviation = level * values.std() * np.where(loud[trial], 10, 1)
            found[trial] = values + deviation * rng.standard_normal(samples)
    return rig, times, angles, torques, np.where(loud, 0.01, 1.0)


@pytest.mark.parametrize("jitter", [0.3, 1.0])
@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
def test_weights_go_with_times_that_jitter(seed: int, jitter: float) -> None:
    rig, times, angles, torques, weights = at_own_times(seed, jitter)
    call: dict[str, Any] = {"t": times, "ensemble_axis": 0, **CONSTANT}
    plain, found = (identify(angles, torques, weights=one, **call) for one in (None, weights))
    for name in ("inertia", "stiffness"):
        # Seeds 1 to 6: errors fall to .22 and .25, and are 1.01 and 1.12 standard errors.
        value, error = found.constants[name]
        assert abs(value - getattr(rig, name)[0]) < 4 * error
        assert error < 0.5 * plain.constants[name][1]
    assert not found.record_status
    alike = identify(angles, torques, weights=np.full(times.size, 3.0), **call)
    np.testing.assert_array_equal(alike.stiffness, plain.stiffness)
    none = np.where(np.arange(times.size) // 20 == 35, 0.0, 1.0)
    left_out = identify(angles, np.where(none > 0, torques, np.inf), weights=none, nan_policy="raise", **call)
    missing = identify(*(np.where(none > 0, one, np.nan) for one in (angles, torques)), **call)
    np.testing.assert_array_equal(left_out.stiffness, missing.stiffness)


def test_weights_of_trials_of_masses_go_with_times_that_jitter() -> None:
    # Two masses that do not touch, and a first trial with ten times the noise.
    rng = np.random.default_rng(1)
    times = np.sort(np.arange(1500) + 5 + rng.uniform(-0.5, 0.5, 1500)) / 1000
    each = []
    for seed in (100, 101, 102, 200, 201, 202):
        rig = tvident.simulate_torsional_rig(
            1.52, sample_rate=4000, seed=seed, pattern="constant", torque_snr_db=200, angle_noise=0
        )
        each.append([make_interp_spline(rig.time, one, k=7)(times) for one in (rig.true_angle, rig.true_torque)])
    clean = np.array(each).reshape(2, 3, 2, times.size).transpose(2, 1, 0, 3)
    loud = np.array([10.0, 1.0, 1.0])[:, np.newaxis, np.newaxis]
    angles, torques = (
        one + loud * level * one.std() * rng.standard_normal(one.shape)
        for one, level in zip(clean, (1e-3, 3e-2), strict=True)
    )
    weights = np.broadcast_to(loud[:, 0] ** -2, (3, times.size))
    structure = tvident.Chain(masses=2, springs=[("base", 0), ("base", 1)], dampers=[("base", 0), ("base", 1)])
    call: dict[str, Any] = {"t": times, "ensemble_axis": 0, "dof_axis": 1, "structure": structure, **CONSTANT}
    plain, found = (identify(angles, torques, weights=one, **call) for one in (None, weights))
    quiet = identify(angles[1:], torques[1:], **call)
    for name in ("inertia_0", "stiffness_base_1"):
        value, error = found.constants[name]
        assert abs(value - getattr(rig, name.split("_")[0])[0]) < 4 * error
        assert error < 0.5 * plain.constants[name][1]
        assert 0.8 < error / quiet.constants[name][1] < 1.1


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (np.ones(300), "shape"),
        (np.ones((2, 400)), "a row for each of 3 trials; got 2"),
        (-np.ones(400), "not negative"),
        (np.zeros(400), "leave something to use"),
        ([np.ones(400), np.ones(400), np.full(399, 2.0)], r"weights\[2\] must have one value for every sample"),
        ([np.ones(400), np.full(400, np.nan), np.ones(400)], r"weights\[1\] must be finite"),
    ],
)
def test_what_is_no_weight_is_refused(weights: Any, message: str) -> None:
    trials = simulated(3, 400, lambda t: 15 + 0 * t, seed=9)
    with pytest.raises(ValueError, match=message):
        identify(trials.angle, trials.torque, weights=weights, **OPTIONS)
