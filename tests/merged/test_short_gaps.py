"""Short gaps in channels of trials and masses: splines go over them, as in those of one mass."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged.simulated import Masses, chain, simulated

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

CHAIN = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)], dampers=[("base", 0), (0, 1)])
OPTIONS: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0, "structure": CHAIN}
SAMPLES = 6000


def masses(seed: int, *, base: bool = False) -> Masses:
    return chain([lambda t: 12 + 0 * t, lambda t: 18 + 0 * t], SAMPLES, seed=seed, base=base)


def with_lost(values: Array, part: float, seed: int) -> Array:
    return np.where(np.random.default_rng(seed).random(values.shape) < part, np.nan, values)


def with_slow_noise(values: Array, part: float, seed: int) -> Array:
    slow = np.random.default_rng(seed).standard_normal(values.shape)
    for place in range(1, SAMPLES):
        slow[:, place] = 0.9 * slow[:, place - 1] + np.sqrt(1 - 0.9**2) * slow[:, place]
    return np.asarray(values + part * values.std(axis=1, keepdims=True) * slow)


def worst(result: Any, truth: Masses) -> float:
    """Give the largest distance of a constant from the truth, in standard errors."""
    true = dict(zip(("inertia_0", "inertia_1"), truth.inertia, strict=True))
    true |= {"stiffness_base_0": 12.0, "stiffness_0_1": 18.0}
    return float(
        max(abs(result.constants[name][0] - value) / result.constants[name][1] for name, value in true.items())
    )


def compared(result: Any, whole: Any) -> float:
    """Give how many times as large standard errors are as those of a whole record, at most."""
    return float(max(result.constants[name][1] / whole.constants[name][1] for name in whole.constants))


@pytest.mark.parametrize("part", [0.01, 0.05, 0.1])
def test_masses_that_lost_single_samples_are_known_nearly_as_well_as_whole_ones(part: float) -> None:
    record = masses(51400)
    whole = identify(record.angle, record.torque, **OPTIONS)
    result = identify(with_lost(record.angle, part, 1), with_lost(record.torque, part, 2), **OPTIONS)
    assert compared(result, whole) < 1.0 + 4 * part
    assert worst(result, record) < 4
    assert "which were bridged by splines" in result.reasons[0]
    assert result.trusted.all()
    assert result.settings["bridged"] > 1


def test_settings_bridge_the_gaps_of_another_day_likewise() -> None:
    first, other = masses(51401), masses(51402)
    found = identify(with_lost(first.angle, 0.05, 3), first.torque, **OPTIONS)
    again = identify(with_lost(other.angle, 0.05, 4), other.torque, **OPTIONS, settings=found.settings)
    kept = ("spline_order", "bridged", "window_length", "exponent")
    assert {name: again.settings[name] for name in kept} == {name: found.settings[name] for name in kept}


def test_a_base_that_lost_samples_is_bridged() -> None:
    record = masses(51403, base=True)
    lost = with_lost(np.asarray(record.base), 0.05, 5)
    driven = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)], dampers=[("base", 0), (0, 1)], base=lost)
    result = identify(record.angle, record.torque, **{**OPTIONS, "structure": driven})
    assert worst(result, record) < 4
    assert result.trusted.all()


def test_noise_with_a_colour_keeps_it() -> None:
    record = masses(51404)
    angle = with_slow_noise(record.angle, 3e-3, 6)
    whole = identify(angle, record.torque, **OPTIONS)
    result = identify(with_lost(angle, 0.02, 7), record.torque, **OPTIONS)
    assert compared(result, whole) == pytest.approx(1.0, abs=0.1)
    assert worst(result, record) < 4


@pytest.mark.parametrize("slow_part", [0.0, 3e-3])
def test_progress_is_told_to_the_end(slow_part: float) -> None:
    record = masses(51404)
    told: list[float] = []
    angle = with_lost(with_slow_noise(record.angle, slow_part, 6), 0.02, 7)
    identify(angle, record.torque, **OPTIONS, progress=lambda done, total: told.append(done / total))
    assert told == sorted(told)
    assert told[-1] == 1


def test_trials_that_lost_samples_have_errors_of_whole_ones() -> None:
    trials = simulated(6, 1500, lambda t: 15 + 0 * t, seed=51405)
    options: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0, "stiffness": "constant"}
    whole = identify(trials.angle, trials.torque, **options)
    angle, torque = with_lost(trials.angle, 0.05, 8), with_lost(trials.torque, 0.05, 9)
    result = identify(list(angle), [one[:1500] for one in torque], **options)
    assert compared(result, whole) < 1.2
    for name, value in (("inertia", trials.inertia), ("stiffness", 15.0)):
        estimate, error = result.constants[name]
        assert abs(estimate - value) < 4 * error
    assert "and likewise in 5 more of 6 trials" in result.reasons[0]


def test_samples_without_weight_are_bridged() -> None:
    record = masses(51406)
    weights = np.where(np.random.default_rng(10).random(SAMPLES) < 0.05, 0.0, 1.0)
    whole = identify(record.angle, record.torque, **OPTIONS)
    result = identify(np.where(weights > 0, record.angle, 1e3), record.torque, **OPTIONS, weights=weights)
    assert compared(result, whole) < 1.2
    assert worst(result, record) < 4


def test_long_gaps_stay_gaps() -> None:
    record = masses(51407)
    angle = record.angle.copy()
    angle[0, 2000:2100] = np.nan
    result = identify(angle, record.torque, **OPTIONS)
    assert not any("bridged" in one for one in result.reasons)
    assert (result.status[2000:2100] & int(tvident.Status.GAP)).all()
    assert worst(result, record) < 4


@pytest.mark.parametrize("dead", ["angle", "torque", "both", "no weight", "a few samples"])
def test_a_trial_without_a_channel_tells_nothing_of_the_others(dead: str) -> None:
    trials = simulated(6, 1500, lambda t: 15 + 0 * t, seed=71111)
    angle, torque = list(with_lost(trials.angle, 0.05, 8)), list(with_lost(trials.torque, 0.05, 9))
    options: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0, "stiffness": "constant"}
    others = [0, 1, 2, 4, 5]
    of_others = identify([angle[one] for one in others], [torque[one] for one in others], **options)
    if dead in {"angle", "both"}:
        angle[3] = np.full_like(angle[3], np.nan)
    if dead in {"torque", "both"}:
        torque[3] = np.full_like(torque[3], np.nan)
    if dead == "no weight":
        options["weights"] = np.where(np.arange(6)[:, np.newaxis] == 3, 0.0, np.ones((6, 1500)))
    if dead == "a few samples":
        angle[3], torque[3] = angle[3][:5], torque[3][:5]
    result = identify(angle, torque, **options)
    for name, (value, error) in of_others.constants.items():
        assert result.constants[name][0] == pytest.approx(value, abs=0.5 * error)
        assert result.constants[name][1] == pytest.approx(error, rel=0.05)
    assert result.record_status == of_others.record_status


def test_a_sample_that_is_missing_costs_no_trust_where_windows_are_short() -> None:
    made = simulated(4, 8000, lambda t: 15 + 4.5 * np.sin(2 * np.pi * t / 0.8), seed=5601)
    angle = made.angle.copy()
    angle[:, 4000] = np.nan
    found = identify(angle, made.torque, sample_rate=1000, ensemble_axis=0)
    assert found.settings["regression_window"][0] < 2 * found.settings["window_length"][0]
    assert found.trusted.all()
    # Over a second nobody knows what the stiffness does.
    angle[:, 4000:4900] = np.nan
    found = identify(angle, made.torque, sample_rate=1000, ensemble_axis=0)
    assert not found.trusted[4100:4800].any()
    error = np.abs(found.stiffness - made.stiffness)[found.trusted]
    assert (error < 5 * found.stderr["stiffness"][found.trusted]).all()
