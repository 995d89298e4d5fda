"""Weights of samples whose times are not uniform, or of which angle and torque have clocks of their own."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

import tvident
from identify.half_noisy import assert_weights_help, found_alike
from parameters import examples
from reference.weak_form import roots, rows
from tvident._clocks import weights_on_grid

Array = npt.NDArray[np.float64]

RATE = 1000.0
CONSTANT: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
COVERED = (0.9, 0.98)
"""Share of true values within 1.96 standard errors that is promised."""


@cache
def clean(seed: int, duration: float, pattern: Any) -> tvident.SimulatedRecording:
    return tvident.simulate_torsional_rig(
        duration=duration + 0.02, sample_rate=4 * RATE, seed=seed, pattern=pattern, torque_snr_db=200, angle_noise=0
    )


def taken(seed: int, jitter: float, duration: float, pattern: Any = "constant") -> tuple[Array, Array, Array, Array]:
    """Give times that jitter, angle and torque of a rig whose second half has ten times the noise, and their weights."""
    simulated, generator = clean(seed, duration, pattern), np.random.default_rng(seed)
    samples = int(duration * RATE)
    times = np.sort(np.arange(samples) + 5 + jitter * generator.uniform(-0.5, 0.5, samples)) / RATE
    deviation = np.where(np.arange(samples) < samples // 2, 1.0, 10.0)

    def noisy(channel: Array, level: float) -> Array:
        values = make_interp_spline(simulated.time, channel, k=7)(times)
        noise = level * values.std() * deviation * generator.standard_normal(samples)
        return np.asarray(values + noise, np.float64)

    return times, noisy(simulated.true_angle, 1e-3), noisy(simulated.true_torque, 2e-2), deviation**-2


@given(
    seed=st.integers(0, 2**32 - 1),
    samples=st.integers(1, 60),
    jitter=st.floats(0, 0.9),
    none=st.sampled_from([0.0, 0.3, 1.0]),
    left_out=st.booleans(),
)
def test_weights_on_a_grid_are_those_of_the_variance_between_samples(
    seed: int, samples: int, jitter: float, none: float, *, left_out: bool
) -> None:
    generator = np.random.default_rng(seed)
    places = np.cumsum(np.where(generator.random(samples) < 0.1, 3.0, 1.0)) + jitter * generator.uniform(
        -0.5, 0.5, samples
    )
    places -= places[0]
    weights = 10 ** generator.uniform(-3, 3, (2, samples))
    weights[generator.random(weights.shape) < none] = 0
    grid = int(places[-1]) + 1
    found = weights_on_grid(places, weights, grid, left_out=left_out)
    for row, one in zip(weights, found, strict=True):
        there = np.flatnonzero(row > 0)
        for place in range(grid):
            if not there.size:
                assert one[place] == 0
                continue
            before, after = there[places[there] <= place], there[places[there] >= place]
            left, right = before[-1] if before.size else after[0], after[0] if after.size else before[-1]
            share = 0.0 if left == right else (place - places[left]) / (places[right] - places[left])
            expected = 1 / ((1 - share) / row[left] + share / row[right])
            beside = [np.flatnonzero(places <= place)[-1], *np.flatnonzero(places >= place)[:1]]
            if left_out and not row[beside].all():
                expected = 0
            assert one[place] == pytest.approx(expected, rel=1e-9)


@settings(max_examples=examples(10))
@given(
    seed=st.integers(0, 2**32 - 1),
    half=st.integers(8, 60),
    exponent=st.integers(4, 12),
    jitter=st.sampled_from([0.1, 0.3]),
    own=st.booleans(),
)
def test_constants_are_weighted_least_squares_of_the_rows_on_the_grid(
    seed: int, half: int, exponent: int, jitter: float, *, own: bool
) -> None:
    generator = np.random.default_rng(seed)
    samples = 1500
    times = np.arange(samples) + jitter * generator.uniform(-0.5, 0.5, samples)
    times = (times - times[0]) / RATE
    rates, phases = 2 * np.pi * generator.uniform(1, 10, (8, 1)), generator.uniform(0, 6, (8, 1))
    angle, velocity, acceleration = (
        np.sum(rates**k * np.sin(rates * times + phases + k * np.pi / 2), axis=0) for k in range(3)
    )
    torque = 0.01 * acceleration + 0.05 * velocity + 15 * angle + 0.3 * generator.standard_normal(samples)
    weights = generator.uniform(0.1, 3, samples) * np.exp(generator.uniform(-3, 3) * np.linspace(-1, 1, samples))
    form = tvident.WeakForm(window_length=2 * half + 1, exponent=exponent, averaging=False, regression_window=300)
    # The torque has the clock of the angle, or one that is told apart from it.
    found = tvident.identify(
        angle,
        torque,
        t=(times, times) if own else times,
        weights=weights,
        method=form,
        terms=(),
        quantisation=0,
        **CONSTANT,
    )
    period = 1 / found.settings["sample_rate"]
    places = (times - found.time[0]) / period
    order = 5 if own else found.settings["spline_order"]
    grid = np.arange(found.time.size)
    even = [make_interp_spline(places, one, k=order)(np.clip(grid, places[0], places[-1])) for one in (angle, torque)]
    design, side = rows(even[0], even[1], half, exponent, period)
    root = roots(1 / np.interp(grid, places, 1 / weights), half, exponent, period)
    usable = np.isfinite(side)
    expected = np.linalg.lstsq((design * root[:, np.newaxis])[usable], (side * root)[usable])[0]
    for value, (name, (constant, error)) in zip(expected, found.constants.items(), strict=True):
        assert abs(constant - value) < 1e-5 * abs(value) + 1e-2 * error, name


@pytest.mark.parametrize("method", ["auto", "paper"])
@pytest.mark.parametrize("jitter", [0.3, 1.0])
def test_equal_weights_are_none_and_weight_zero_is_missing(method: Any, jitter: float) -> None:
    times, angle, torque, _ = taken(0, jitter, 3.0)
    call: dict[str, Any] = {"method": method, "t": times}
    found_alike(
        tvident.identify(angle, torque, weights=np.full(angle.size, 0.3), **call),
        tvident.identify(angle, torque, **call),
    )
    out = np.zeros(angle.size, bool)
    out[1000:1003] = out[2000] = out[2500:2540] = True
    spoilt = np.where(out, 1e3, angle)
    found = tvident.identify(spoilt, torque, weights=np.where(out, 0.0, 0.3), nan_policy="raise", **call)
    missing = [np.where(out, np.nan, one) for one in (angle, torque)]
    found_alike(found, tvident.identify(*missing, **call))


def test_a_sample_without_weight_is_left_out_where_missing_ones_propagate() -> None:
    times, angle, torque, _ = taken(0, 0.3, 3.0)
    out = np.arange(angle.size) == 1000
    call: dict[str, Any] = {"t": times, "method": "paper", "weights": np.where(out, 0.0, 1.0)}
    missing = np.where(np.arange(angle.size) == 2000, np.nan, np.where(out, np.nan, angle))
    found = tvident.identify(missing, torque, nan_policy="propagate", **call)
    assert np.isfinite(found.stiffness[1150])  # half of the equations of its window are there
    assert np.isnan(found.stiffness[2000])


@pytest.mark.slow
@pytest.mark.parametrize("jitter", [0.3, 1.0])
def test_weights_make_errors_smaller_where_half_of_the_record_is_noisier(jitter: float) -> None:
    # As at uniform times.
    def identified(seed: int, has_weights: bool) -> tuple[tvident.Identification, dict[str, float]]:
        times, angle, torque, weights = taken(seed, jitter, 6.0)
        found = tvident.identify(angle, torque, t=times, weights=weights if has_weights else None, **CONSTANT)
        return found, {name: float(getattr(clean(seed, 6.0, "constant"), name)[0]) for name in ("inertia", "stiffness")}

    assert_weights_help(identified)


@pytest.mark.slow
@pytest.mark.parametrize("jitter", [0.3, 1.0])
def test_errors_hold_where_half_of_the_record_is_noisier(jitter: float) -> None:
    covered, errors = [], []
    for seed in range(3):
        times, angle, torque, weights = taken(seed, jitter, 24.0, "slider")
        known = clean(seed, 24.0, "slider")
        off = []
        for one in (None, weights):
            found = tvident.identify(angle, torque, t=times, weights=one)
            off.append(found.stiffness - np.interp(found.time, known.time, known.stiffness))
        covered.append(np.abs(off[1]) < 1.96 * found.stderr["stiffness"])
        errors.append([np.sqrt(np.mean(one**2)) for one in off])
    assert COVERED[0] < np.mean(covered) < COVERED[1], np.mean(covered)
    plain, weighted = np.sqrt(np.mean(np.square(errors), axis=0))
    assert weighted < 0.9 * plain


@pytest.mark.parametrize("of_torque", [False, True])
def test_weights_of_one_channel_of_two_clocks_are_those_of_both(*, of_torque: bool) -> None:
    known = clean(1, 6.0, "constant")
    generator = np.random.default_rng(1)
    clocks = (np.arange(5900) / RATE + 0.005, np.arange(2900) / 500 + 0.0103)
    levels = (1e-3, 2e-2)
    channels = []
    for clock, truth, level in zip(clocks, (known.true_angle, known.true_torque), levels, strict=True):
        values = make_interp_spline(known.time, truth, k=7)(clock)
        deviation = np.where(clock < 3, 1.0, 10.0)
        channels.append(values + level * values.std() * deviation * generator.standard_normal(clock.size))
    own = clocks[of_torque]
    plain = tvident.identify(*channels, t=clocks, **CONSTANT)
    found_alike(tvident.identify(*channels, t=clocks, weights=np.full(own.size, 0.3), **CONSTANT), plain)
    found = tvident.identify(*channels, t=clocks, weights=np.where(own < 3, 1.0, 0.01), **CONSTANT)
    for name in CONSTANT:
        value, error = found.constants[name]
        assert abs(value - float(getattr(known, name)[0])) < 4 * error
        assert error < 0.5 * plain.constants[name][1]
    # What has no weight is missing in both channels, whatever it holds there.
    spoilt = [np.where((clock > 2) & (clock < 2.5), 1e3, one) for clock, one in zip(clocks, channels, strict=True)]
    missing = [np.where((clock > 2) & (clock < 2.5), np.nan, one) for clock, one in zip(clocks, channels, strict=True)]
    without = np.where((own > 1.999) & (own < 2.501), 0.0, 1.0)
    left_out = tvident.identify(*spoilt, t=clocks, weights=without, nan_policy="raise", **CONSTANT)
    omitted = tvident.identify(*missing, t=clocks, **CONSTANT)
    for name in CONSTANT:
        value, error = omitted.constants[name]
        assert abs(left_out.constants[name][0] - value) < 0.2 * error


@pytest.mark.parametrize("align", ["offset", "drift"])
def test_clocks_are_aligned_where_half_of_the_record_is_noisier(align: Any) -> None:
    known, generator = clean(3, 12.4, "constant"), np.random.default_rng(3)
    clocks = np.arange(12_000) / RATE + 0.1, np.arange(4800) / 400 + 0.1137
    channels = []
    for clock, truth, level in zip(clocks, (known.true_angle, known.true_torque), (1e-3, 2e-2), strict=True):
        values = make_interp_spline(known.time, truth, k=7)(clock)
        deviation = np.where(clock < 6, 1.0, 10.0)
        channels.append(values + level * values.std() * deviation * generator.standard_normal(clock.size))
    drift = 1e-4 if align == "drift" else 0.0
    stamps = clocks[0], clocks[1] + 0.05 + drift * (clocks[1] - 0.1)
    weights = np.where(clocks[0] < 6, 1.0, 0.01)
    plain, found = (
        tvident.identify(*channels, t=stamps, weights=one, align=align, **CONSTANT) for one in (None, weights)
    )
    # Eight records with torques at 1 kHz and 400 Hz: errors fall to a quarter, and are .7 to 1.2 standard errors.
    for name in CONSTANT:
        value, error = found.constants[name]
        assert abs(value - float(getattr(known, name)[0])) < 3 * error
        assert error < 0.4 * plain.constants[name][1]
    name, true = ("clock_drift", drift) if drift else ("clock_offset", 0.05)
    value, error = found.constants[name]
    assert abs(value - true) < 3.5 * error < 1e-4


def test_an_alignment_in_seconds_goes_with_any_weights_and_one_that_is_sought_with_those_above_zero() -> None:
    times, angle, torque, weights = taken(2, 0.0, 6.0)
    late = times + 0.02
    call: dict[str, Any] = {"weights": weights, **CONSTANT}
    found = tvident.identify(angle, torque, t=(times, late), align=0.02, **call)
    expected = tvident.identify(angle, torque, t=(times, times), **call)
    for name in CONSTANT:
        # The record begins 20 samples later.
        value, error = expected.constants[name]
        assert abs(found.constants[name][0] - value) < 0.5 * error
    some = np.where(np.arange(times.size) == 7, 0.0, weights)
    tvident.identify(angle, torque, t=(times, late), align=0.02, **{**call, "weights": some})
    with pytest.raises(ValueError, match=r"above zero, where its .*; got some of zero and align='offset'; find the"):
        tvident.identify(angle, torque, t=(times, late), align="offset", **{**call, "weights": some})
    with pytest.raises(ValueError, match=r"those of the samples of one channel, .*; got a pair, .*; give one array"):
        tvident.identify(angle, torque[::2], t=(times, late[::2]), weights=(weights, weights[::2]))
    pair: Any = (weights, None)
    with pytest.raises(ValueError, match="got a pair"):
        tvident.identify(angle, torque[::2], t=(times, late[::2]), weights=pair)
    with pytest.raises(ValueError, match=r"got weights of the torque's samples and align='drift'; find the"):
        tvident.identify(angle, torque[::2], t=(times, late[::2]), align="drift", **{**call, "weights": weights[::2]})
