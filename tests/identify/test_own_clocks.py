"""Angle and torque with clocks of their own: other rates, other beginnings, drift."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import make_interp_spline

import tvident

Array = npt.NDArray[np.float64]

CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
DURATION = 12.0


@cache
def rig(seed: int) -> tvident.SimulatedRecording:
    return tvident.simulate_torsional_rig(
        duration=DURATION + 1, sample_rate=2000, seed=seed, pattern="constant", torque_snr_db=200, angle_noise=0
    )


def sampled(seed: int, channel: str, t: Array, noise: float) -> Array:
    simulated = rig(seed)
    values = make_interp_spline(simulated.time, getattr(simulated, f"true_{channel}"), k=7)(t)
    return np.asarray(
        values + noise * values.std() * np.random.default_rng(seed + len(channel)).standard_normal(t.size)
    )


def clock(rate: float, start: float = 0.5) -> Array:
    return start + np.arange(int((DURATION - 1) * rate)) / rate


def within_errors(result: tvident.Identification, seed: int, most: float = 4.0) -> None:
    """Check that constants are within so many standard errors of the truth, and that these are small."""
    for name in CONSTANT:
        value, error = result.constants[name]
        truth = float(getattr(rig(seed), name)[0])
        assert abs(value - truth) <= most * error, name
        assert error < 0.1 * truth, name


@pytest.mark.parametrize("rate", [100.0, 2000.0])
def test_a_torque_of_another_rate(rate: float) -> None:
    ours, theirs = clock(1000.0), clock(rate, 0.5003)
    angle, torque = sampled(1, "angle", ours, 1e-3), sampled(1, "torque", theirs, 0.05)
    result = tvident.identify(angle, torque, t=(ours, theirs), **CONSTANT)
    within_errors(result, 1)
    assert result.settings["sample_rate"] == pytest.approx(max(1000.0, rate))
    assert result.time[0] == pytest.approx(0.5, abs=2e-3)
    assert "each by its own clock" in result.reasons[0]
    begun = tvident.identify(angle, sampled(1, "torque", clock(rate), 0.05), sample_rate=(1000.0, rate), **CONSTANT)
    within_errors(begun, 1)


def error_and_coverage(result: tvident.Identification, seed: int) -> tuple[float, float]:
    """Return the relative error of the stiffness where it is trusted, and the part of it within two standard errors."""
    off = (result.stiffness - rig(seed).stiffness[0])[result.trusted]
    errors = result.stderr["stiffness"][result.trusted]
    return float(np.sqrt(np.mean(off**2)) / rig(seed).stiffness[0]), float(np.mean(np.abs(off) < 2 * errors))


@pytest.mark.parametrize("rate", [500.0, 3000.0])
@pytest.mark.parametrize("method", ["paper", tvident.StrongForm(window_length=101, regression_window=150)])
def test_in_strong_form_derivatives_are_those_of_the_angles_own_samples(rate: float, method: Any) -> None:
    options: dict[str, Any] = {"method": method, **dict.fromkeys(CONSTANT, "windowed")}
    angle = sampled(2, "angle", clock(600.0), 1e-3)
    torque, at_one_rate = (sampled(2, "torque", clock(one), 1e-2) for one in (rate, 600.0))
    result = tvident.identify(angle, torque, sample_rate=(600.0, rate), **options)
    assert result.settings["sample_rate"] == pytest.approx(600.0)
    error, coverage = error_and_coverage(result, 2)
    usual_error, usual_coverage = error_and_coverage(
        tvident.identify(angle, at_one_rate, sample_rate=600.0, **options), 2
    )
    assert error < 1.3 * usual_error
    assert coverage > usual_coverage - 0.05
    again = tvident.identify(angle, torque, sample_rate=(600.0, rate), settings=result.settings)
    np.testing.assert_array_equal(again.stiffness, result.stiffness)


@pytest.mark.parametrize("rate", [250.0, 2000.0])
@pytest.mark.parametrize("part", [0.003, 0.03, 0.1])
def test_samples_that_a_channel_misses_cost_little(rate: float, part: float) -> None:
    angle, torque = sampled(3, "angle", clock(1000.0), 1e-3), sampled(3, "torque", clock(rate), 1e-2)
    whole = tvident.identify(angle, torque, sample_rate=(1000.0, rate), **CONSTANT)
    rng = np.random.default_rng(3)
    angle, torque = (np.where(rng.random(one.size) < part, np.nan, one) for one in (angle, torque))
    result = tvident.identify(angle, torque, sample_rate=(1000.0, rate), **CONSTANT)
    within_errors(result, 3)
    for name in CONSTANT:
        assert result.constants[name][1] < (1.1 + 6 * part) * whole.constants[name][1]
    missing = tvident.identify(angle, torque, sample_rate=(1000.0, rate), nan_policy="propagate", **CONSTANT)
    assert missing.constants["inertia"][1] > result.constants["inertia"][1] or part < 0.01


def test_records_of_a_list_have_clocks_of_their_own() -> None:
    records = [
        (sampled(seed, "angle", clock(800.0), 1e-3), sampled(seed, "torque", clock(300.0), 1e-2)) for seed in (1, 2, 3)
    ]
    angles, torques = [one[: -8 * place or None] for place, (one, _) in enumerate(records)], [one for _, one in records]
    each = [tvident.identify(*one, sample_rate=(800.0, 300.0), **CONSTANT) for one in zip(angles, torques, strict=True)]
    times = [(clock(800.0)[: one.size] - 0.5, clock(300.0) - 0.5) for one in angles]
    identify: Any = tvident.identify
    of_rates: list[dict[str, Any]] = [
        {"sample_rate": (800.0, 300.0)},
        {"sample_rate": [(800.0, 300.0)] * 3},
        {"t": times},
    ]
    of_periods: list[dict[str, Any]] = [{"delta": (1 / 800, 1 / 300)}, {"delta": [(1 / 800, 1 / 300)] * 3}]
    for said in (*of_rates, *of_periods):
        for found, alone in zip(identify(angles, torques, **said, **CONSTANT), each, strict=True):
            assert found.constants["stiffness"] == pytest.approx(alone.constants["stiffness"], rel=1e-9)
    # Two records of one length have two rates between them, unless those of angle and torque differ.
    pair = identify([records[0][0]] * 2, [records[0][1]] * 2, sample_rate=(800.0, 300.0), share="inertia", **CONSTANT)
    within_errors(pair[0], 1)
    shared = identify(angles, torques, sample_rate=(800.0, 300.0), share=("inertia",))
    assert shared.constants["inertia"][1] < min(one.constants["inertia"][1] for one in each)


@pytest.mark.parametrize("channel", ["angle", "torque"])
def test_missing_samples_are_refused_where_they_are_to_be(channel: str) -> None:
    channels = {"angle": sampled(1, "angle", clock(800.0), 1e-3), "torque": sampled(1, "torque", clock(300.0), 1e-2)}
    channels[channel][500] = np.nan
    identify: Any = tvident.identify
    with pytest.raises(
        ValueError, match=f"{channel} must hold finite numbers where nan_policy='raise'; sample 500 is nan"
    ):
        identify(**channels, sample_rate=(800.0, 300.0), nan_policy="raise", **CONSTANT)


def test_an_offset_is_found_from_the_equation() -> None:
    ours, theirs = clock(1000.0), clock(1000.0, 0.6)
    angle, torque = sampled(2, "angle", ours, 1e-3), sampled(2, "torque", theirs, 0.05)
    for offset in (0.2137, -0.0304):
        result = tvident.identify(angle, torque, t=(ours, theirs + offset), align="offset", **CONSTANT)
        found, error = result.constants["clock_offset"]
        assert abs(found - offset) <= 4 * error
        assert error < 1e-3
        within_errors(result, 2)
    again = tvident.identify(angle, torque, t=(ours, theirs + offset), settings=result.settings)
    assert again.constants["stiffness"][0] == pytest.approx(result.constants["stiffness"][0], rel=1e-6)


def test_a_drift_is_found_from_the_equation() -> None:
    ours, theirs = clock(1000.0), clock(500.0, 0.6)
    drift, offset = 3e-4, 0.02
    angle, torque = sampled(3, "angle", ours, 1e-3), sampled(3, "torque", theirs, 0.05)
    stamps = theirs + offset + drift * (theirs - theirs[0])
    result = tvident.identify(angle, torque, t=(ours, stamps), align="drift", **CONSTANT)
    found, error = result.constants["clock_drift"]
    assert abs(found - drift) <= 4 * error
    assert error < drift / 3
    within_errors(result, 3)


@pytest.mark.parametrize("seed", [1, 2])
def test_errors_know_how_well_clocks_are_aligned(seed: int) -> None:
    # Far below the resonance a lag looks like damping: K times the offset's error is 15 times the damping's own.
    generator = np.random.default_rng(seed)
    truth = {"inertia": 0.01, "damping": 0.05, "stiffness": 20.0}
    rates, phases = 2 * np.pi * generator.uniform(0.5, 4, (8, 1)), generator.uniform(0, 6, (8, 1))

    def motion(t: Array, derivative: int) -> Array:
        return np.asarray(np.sum(rates**derivative * np.sin(rates * t + phases + derivative * np.pi / 2), axis=0))

    ours, theirs = clock(500.0), clock(500.0, 0.6)
    angle = motion(ours, 0) + 1e-4 * generator.standard_normal(ours.size)
    torque = sum(value * motion(theirs, 2 - place) for place, value in enumerate(truth.values()))
    torque += 0.5 * generator.standard_normal(theirs.size)
    times = (ours, theirs + 0.1)
    found = tvident.identify(angle, torque, t=times, align="offset", **CONSTANT)
    offset, error = found.constants["clock_offset"]
    known, later = (
        tvident.identify(angle, torque, t=times, align=offset + move, settings=found.settings) for move in (0, error)
    )
    for name, value in truth.items():
        (estimate, all_of_it), (same, own), (moved, _) = (one.constants[name] for one in (found, known, later))
        assert estimate == pytest.approx(same, rel=1e-6)
        assert all_of_it == pytest.approx(np.hypot(own, moved - same), rel=1e-3)
        assert abs(estimate - value) < 4 * all_of_it
    assert found.constants["damping"][1] > 5 * known.constants["damping"][1]
    assert found.stderr["damping"][0] == pytest.approx(found.constants["damping"][1])


def test_what_cannot_be_aligned_is_said() -> None:
    t = clock(1000.0)
    angle, torque = sampled(4, "angle", t, 1e-3), sampled(4, "torque", t, 0.05)
    with pytest.raises(ValueError, match=r"align must be .* got 'always'"):
        tvident.identify(angle, torque, sample_rate=1000, align="always")
    with pytest.raises(ValueError, match=r"must overlap; they share 0 s"):
        tvident.identify(angle, torque, t=(t, t + 100.0))
    with pytest.raises(ValueError, match=r"angle and torque alone; got velocity"):
        tvident.identify(angle, torque, velocity=angle, t=(t, t))
    sparse = np.where(np.arange(t.size) % 2, torque, np.nan)
    refused: list[tuple[dict[str, Any], str]] = [
        ({}, "t=(t, t), which"),
        ({"velocity": angle}, "resample it"),
        ({"weights": t}, "t=(t, t), which"),
    ]
    for others, cure in refused:
        with pytest.raises(ValueError, match=rf"one in every 2 only, .*; .*{re.escape(cure)}"):
            tvident.identify(angle, sparse, sample_rate=1000, **others)
    with pytest.raises(ValueError, match=r"one in every 2 only, .* resample it"):
        tvident.identify(np.stack([angle] * 2), np.stack([sparse] * 2), sample_rate=1000)
    with pytest.raises(ValueError, match="align needs the weak form"):
        tvident.identify(angle, torque, sample_rate=1000, align="offset", method="paper")


@pytest.mark.parametrize("lost", ["the torque's first half", "all of the torque"])
def test_what_is_lost_of_a_channel_is_not_taken_for_a_clock(lost: str) -> None:
    simulated = tvident.simulate_torsional_rig(duration=3.0, sample_rate=200.0)
    torque = np.roll(simulated.torque, 7)
    torque[: 300 if "half" in lost else None] = np.nan
    times = simulated.time
    found = tvident.identify(simulated.angle, torque, t=(times, times), align="offset")
    offset, error = found.constants["clock_offset"]
    if "half" in lost:
        assert abs(offset - 7 / 200) < 4 * error < 0.002
    else:
        assert np.isnan(error)
        assert not found.trusted.any()
        assert any("how the clocks" in words for words in found.advice)


def test_clocks_that_cannot_be_aligned_say_why() -> None:
    simulated = tvident.simulate_torsional_rig(duration=3.0, sample_rate=200.0)
    times = simulated.time
    with pytest.raises(ValueError, match="a clock must go on where its stamps are moved"):
        tvident.identify(simulated.angle, simulated.torque, t=(times, times), align=1e18)
    with pytest.raises(ValueError, match="at least 64 samples"):
        tvident.identify(simulated.angle[:20], simulated.torque[:20], t=(times[:20], times[:20]), align="drift")


def test_samples_lost_at_regular_places_of_two_clocks_are_known() -> None:
    """One of 500 lost was a clock of 998 Hz in few digits, beside that of the torque: inertia was .56 % off, eight errors."""
    rig = tvident.simulate_torsional_rig(duration=20.0, pattern="constant")
    there = np.arange(rig.angle.size) % 500 != 499
    options: dict[str, Any] = {"stiffness": "constant", "damping": "constant"}
    whole = tvident.identify(rig.angle, rig.torque, t=(rig.time, rig.time), **options).constants
    found = tvident.identify(
        rig.angle[there], rig.torque, t=(np.round(rig.time[there], 3), rig.time), **options
    ).constants
    for name, (value, stderr) in whole.items():
        assert abs(found[name][0] - value) < stderr, name
