"""Inner parameters of terms, found by a search: the delay of a reflex, the width of a backlash, the Stribeck velocity."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident._equation import expected_stribeck
from tvident._identify.minimum import GRID, lowest

Array = npt.NDArray[np.float64]

RATE, SAMPLES, RECORDS = 500, 2500, 6
INERTIA, DAMPING, STIFFNESS = 0.02, 0.1, 8.0
CONSTANT: dict[str, Any] = {
    "sample_rate": RATE,
    "inertia": "constant",
    "damping": "constant",
    "stiffness": "constant",
}
TRUTH = {"inertia": INERTIA, "damping": DAMPING, "stiffness": STIFFNESS}


def reflex(t: Array, angle: Array, velocity: Array, delay: float) -> Array:
    """Answer the velocity of some time ago; what was before the record is not known."""
    del angle
    return np.interp(t - delay, t, velocity, left=np.nan)


def play(t: Array, angle: Array, velocity: Array, width: float) -> Array:
    """Follow the angle on the other side of a gap."""
    del t, velocity
    held, found = angle[0], np.empty_like(angle)
    for place, moved in enumerate(angle.tolist()):
        held = found[place] = min(max(held, moved - width / 2), moved + width / 2)
    return found


def stribeck(velocity: Array, scale: float) -> Array:
    return np.asarray(np.sign(velocity) * np.exp(-((velocity / scale) ** 2)))


def records(
    effect: Callable[[Array, Callable[[Array], Array], Callable[[Array], Array]], Array], noise: float
) -> tuple[Array, Array]:
    """Give angles and torques of random motions with an effect of time, angle and velocity beside a linear system."""
    angles, torques = [], []
    t = np.arange(SAMPLES) / RATE
    for seed in range(RECORDS):
        generator = np.random.default_rng(seed)
        rate = 2 * np.pi * np.linspace(0.3, 6, 10) * (1 + 0.03 * generator.standard_normal(10))
        height, phase = 0.3 / (1 + rate / 2 / np.pi), generator.uniform(0, 6, 10)

        def angle(t: Array, height: Array = height, rate: Array = rate, phase: Array = phase) -> Array:
            return np.asarray(height @ np.sin(np.multiply.outer(rate, t) + phase[:, np.newaxis]))

        def velocity(t: Array, height: Array = height, rate: Array = rate, phase: Array = phase) -> Array:
            return np.asarray((height * rate) @ np.cos(np.multiply.outer(rate, t) + phase[:, np.newaxis]))

        acceleration = -(height * rate**2) @ np.sin(np.multiply.outer(rate, t) + phase[:, np.newaxis])
        torque = INERTIA * acceleration + DAMPING * velocity(t) + STIFFNESS * angle(t) + effect(t, angle, velocity)
        angles.append(angle(t) + noise * generator.standard_normal(SAMPLES))
        torques.append(torque + 0.05 * generator.standard_normal(SAMPLES))
    return np.array(angles), np.array(torques)


REFLEX = tvident.Term("reflex", reflex, search={"delay": (0.0, 0.2)})
GEAR = tvident.Term("gear", play, search={"width": (0.01, 0.3)})

CASES: dict[str, tuple[Any, Any, float, Any, dict[str, float]]] = {
    "delay": (
        lambda t, _, velocity: 0.3 * velocity(t - 0.045),
        lambda t, *_: np.zeros_like(t),
        2e-4,
        [REFLEX, "offset"],
        {"reflex": 0.3, "reflex.delay": 0.045},
    ),
    "backlash": (
        lambda t, angle, _: 3 * play(t, angle(t), t, 0.08),
        lambda t, *_: np.zeros_like(t),
        2e-4,
        [GEAR, "offset"],
        {"gear": 3.0, "gear.width": 0.08},
    ),
    "stribeck": (
        lambda t, _, velocity: 0.2 * np.sign(velocity(t)) + 0.3 * stribeck(velocity(t), 0.4),
        lambda t, _, velocity: 0.2 * np.sign(velocity(t)),
        2e-5,
        ["coulomb", "stribeck", "offset"],
        {"coulomb": 0.2, "stribeck": 0.3, "stribeck.velocity": 0.4},
    ),
}


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("name", CASES)
def test_an_inner_parameter_is_found_within_its_error_and_nothing_else_is_biased(name: str) -> None:
    effect, _, noise, terms, truth = CASES[name]
    result = tvident.identify(*records(effect, noise), terms=terms, **CONSTANT)
    scores = []
    for parameter, true in (TRUTH | truth).items():
        value, error = result.constants[parameter]
        assert value.shape == (RECORDS,)
        score = (value - true) / error
        # Beyond 4.5 standard errors lies one number of 150 000; the mean of six within 3.5/√6 but for one of 2000.
        assert np.abs(score).max() < 4.5, parameter
        assert abs(score.mean()) < 3.5 / np.sqrt(RECORDS), parameter
        scores.append(score)
    # The parameters of six records are some twenty independent numbers, whose mean square lies between these but for one of a thousand.
    assert 0.35 < np.mean(np.square(scores)) < 2.2
    assert all(all(needed) for needed in result.settings["needed"].values())
    inner = next(parameter for parameter in truth if "." in parameter)
    assert (result.constants[inner][1] < 0.1 * truth[inner]).all()
    assert not any("is not needed" in line for line in result.advice)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("name", CASES)
def test_what_is_not_there_is_not_believed(name: str) -> None:
    _, nothing, noise, terms, truth = CASES[name]
    result = tvident.identify(*records(nothing, noise), terms=terms, **CONSTANT)
    # One of a hundred is believed by chance: more than one of six with a probability of 0.15 %.
    believed = np.sum(next(iter(result.settings["needed"].values())))
    assert believed <= 1
    assert sum("is not needed" in line for line in result.advice) == RECORDS - believed
    inner = next(parameter for parameter in truth if "." in parameter)
    low, high = (0.0, 0.2) if name == "delay" else (0.01, 0.3)
    if name != "stribeck":
        assert (np.sort(result.constants[inner][1])[1:] >= (high - low) / np.sqrt(12) * (1 - 1e-9)).all()


def one_record(effect: Any) -> tuple[Array, Array]:
    angles, torques = records(effect, 2e-4)
    return angles[0], torques[0]


@pytest.mark.slow
def test_settings_replay_what_was_found_without_a_search() -> None:
    angle, torque = one_record(CASES["delay"][0])
    calls = []

    def counted(t: Array, angle: Array, velocity: Array, delay: float) -> Array:
        calls.append(delay)
        return reflex(t, angle, velocity, delay)

    term = tvident.Term("reflex", counted, search={"delay": (0.02, 0.08)})
    first = tvident.identify(angle, torque, terms=[term, "offset"], **CONSTANT)
    searched = len(calls)
    assert searched > GRID
    settings = json.loads(json.dumps(first.settings))
    assert settings["inner"] == {"reflex.delay": first.constants["reflex.delay"][0]}
    calls.clear()
    again = tvident.identify(angle, torque, sample_rate=RATE, settings=settings, terms=[term, "offset"])
    assert len(calls) < searched / 8
    assert again.constants == first.constants
    # It says what it is told, and simulates with the value that was found.
    assert any(line.startswith("reflex.delay 0.04") and "as given" in line for line in again.reasons)
    assert "reflex.delay" in first.summary()
    _, _, predicted = first.predicted_torque()
    # Only what touches the first 45 ms, of which the term says nothing, is missing, beside the ends.
    reach = first.settings["window_length"]
    assert np.isfinite(predicted[reach + 25 : -reach]).all()
    assert first.columns()["reflex.delay"][7] == first.constants["reflex.delay"][0]
    np.testing.assert_array_equal(first.stderr["reflex.delay"], first.constants["reflex.delay"][1])
    scan = first.scan()
    nearest = np.argmin(np.abs(scan.window_length - first.settings["window_length"]))
    assert scan.estimates["reflex.delay"][nearest] == pytest.approx(0.045, abs=0.003)


@pytest.mark.slow
def test_a_record_of_a_batch_and_a_stored_result_know_their_inner_parameters(tmp_path: Path) -> None:
    angles, torques = (both[:2] for both in records(CASES["stribeck"][0], 2e-5))
    both = tvident.identify(angles, torques, terms=["coulomb", "stribeck", "offset"], **CONSTANT)
    second = both[1]
    alone = tvident.identify(angles[1], torques[1], terms=["coulomb", "stribeck", "offset"], **CONSTANT)
    assert second.constants == alone.constants
    assert second.settings == alone.settings
    assert second.value("stribeck.velocity").unit == "rad/s"
    assert any(line.startswith("stribeck.velocity 0.") for line in second.reasons)
    np.testing.assert_array_equal(second.simulate(torques[1]), alone.simulate(torques[1]))
    second.save(tmp_path / "second.npz")
    loaded = tvident.load(tmp_path / "second.npz")
    assert loaded.constants == second.constants
    np.testing.assert_array_equal(loaded.simulate(torques[1], [0.0, 0.0]), second.simulate(torques[1], [0.0, 0.0]))


@pytest.mark.slow
def test_the_end_of_a_range_is_said() -> None:
    angle, torque = one_record(CASES["delay"][0])
    short = tvident.Term("reflex", reflex, search={"delay": (0.005, 0.03)})
    result = tvident.identify(angle, torque, terms=[short, "offset"], **CONSTANT)
    assert result.constants["reflex.delay"][0] == pytest.approx(0.03)
    assert any("highest of its range, 0.03: search a wider range" in line for line in result.advice)


@pytest.mark.slow
def test_the_factor_may_change_while_its_delay_does_not() -> None:
    def growing(t: Array, _: Any, velocity: Callable[[Array], Array]) -> Array:
        return (0.3 + 0.05 * t) * velocity(t - 0.045)

    angle, torque = one_record(growing)
    result = tvident.identify(angle, torque, terms=[(REFLEX, "windowed"), "offset"], **CONSTANT)
    value, error = result.constants["reflex.delay"]
    assert abs(value - 0.045) < 4.5 * error < 0.01
    middle = slice(SAMPLES // 4, -SAMPLES // 4)
    time = np.arange(SAMPLES)[middle] / RATE
    score = (result.terms["reflex"][middle] - 0.3 - 0.05 * time) / result.stderr["reflex"][middle]
    assert np.sqrt(np.mean(score**2)) < 3


@pytest.mark.slow
def test_two_inner_parameters_are_searched_together_in_strong_form() -> None:
    def answer(t: Array, angle: Array, velocity: Array, delay: float, limit: float) -> Array:
        return np.clip(reflex(t, angle, velocity, delay), -limit, limit)

    term = tvident.Term("reflex", answer, search={"delay": (0.02, 0.08), "limit": (0.5, 6.0)})
    angle, torque = one_record(lambda t, _, velocity: 0.6 * np.clip(velocity(t - 0.045), -2, 2))
    form = tvident.StrongForm(window_length=41)
    result = tvident.identify(angle, torque, terms=[term, "offset"], method=form, **CONSTANT)
    # Constants of the strong form may have a bias of two or three standard errors.
    for name, true in (("delay", 0.045), ("limit", 2.0)):
        value, error = result.constants[f"reflex.{name}"]
        assert abs(value - true) < 6 * error + 0.02 * true, name
    assert result.settings["needed"] == {"reflex": True}


def test_stribeck_friction_is_simulated_with_what_was_found() -> None:
    angle, torque = (one[0] for one in records(CASES["stribeck"][0], 2e-5))
    result = tvident.identify(angle, torque, terms=["coulomb", "stribeck", "offset"], **CONSTANT)
    assert result.vaf() > 99
    _, measured, predicted = result.predicted_torque()
    inside = slice(100, -100)
    assert np.std((measured - predicted)[inside]) < 0.1 * np.std(measured[inside])
    state = [float(angle[0]), float((angle[1] - angle[0]) * RATE)]
    slow, fast = (result.simulate(np.full(200, level), [0.0, 0.0]) for level in (0.4, 0.6))
    # Break-away needs both frictions, 0.5 N m, though coulomb alone is 0.2.
    assert (slow == 0).all()
    assert fast[-1] > 0
    assert np.isfinite(result.simulate(torque, state)).all()


@pytest.mark.slow
def test_friction_that_fades_too_fast_for_the_samples_is_said() -> None:
    """With 90 rad/s² the velocity crosses twice 0.25 rad/s within three samples."""
    angle, torque = one_record(lambda t, _, velocity: np.sign(velocity(t)) * 0.2 + 0.5 * stribeck(velocity(t), 0.25))
    result = tvident.identify(angle, torque, terms=["coulomb", "stribeck", "offset"], **CONSTANT)
    assert any("samples of a turn, so stribeck.velocity and its factor depend" in line for line in result.advice)
    assert not any("negative" in line for line in result.advice)


def test_the_stribeck_function_is_its_expectation() -> None:
    generator = np.random.default_rng(1)
    velocity, error = np.array([-1.0, 0.0, 0.1, 0.4, 2.0, np.nan]), np.array([0.3, 0.3, 0.2, 0.0, 1e-3, 0.1])
    drawn = velocity + error * generator.standard_normal((400_000, 6))
    mean = stribeck(drawn, 0.5).mean(axis=0)
    # Means of 400 000 draws of at most one scatter by 0.0016.
    np.testing.assert_allclose(expected_stribeck(velocity, error, 0.5), mean, atol=6 * 0.0016)
    assert expected_stribeck(velocity, error, 0.5)[3] == pytest.approx(stribeck(np.array([0.4]), 0.5)[0])


def test_the_deepest_of_several_valleys_is_found_within_forty_places() -> None:
    depth, centre = np.array([1.0, 3.0]), np.array([0.31, 0.74])
    tried = []

    def criterion(place: Array) -> Array:
        tried.append(place)
        valleys = np.exp(-(((place[:, np.newaxis] - centre) / 0.05) ** 2)) * np.stack([depth, depth[::-1]])
        return np.asarray(1000 * (place - 0.5) ** 2 / 1000 - 100 * valleys.sum(axis=1))

    best = lowest(criterion, 2)
    np.testing.assert_allclose(best.place, [0.74, 0.31], atol=2e-3)
    assert len(tried) <= 30


def test_wrong_searches_are_refused_with_the_rule() -> None:
    for search, error, words in (
        ({"delay": (0.08, 0.02)}, ValueError, "must go upwards; got 0.08 to 0.02"),
        ({"delay": 0.05}, TypeError, r"must be a pair; got 0.05; write \(0.02, 0.08\)"),
        ({"delay": (0.0, np.nan)}, ValueError, "must be finite"),
        ({"width": (0, 1)}, TypeError, "must take its inner parameters by name; got width"),
        ({}, TypeError, "must take its inner parameters by name"),
        ([("delay", (0, 1))], TypeError, "must be a mapping of names to ranges"),
        ({"a": (0, 1), "b": (0, 1), "c": (0, 1), "d": (0, 1)}, ValueError, "may name 3 inner parameters; got 4"),
    ):
        with pytest.raises(error, match=words):
            tvident.Term("reflex", reflex, search=search)  # type: ignore[arg-type]
    angle, torque = one_record(CASES["delay"][0])
    with pytest.raises(ValueError, match="linear in what is unknown; got 'stribeck'"):
        tvident.identify(angle, torque, sample_rate=RATE, instrument=angle, terms=["stribeck"])
    with pytest.raises(ValueError, match=r"must not share its name with a term; got 'reflex.delay' twice"):
        tvident.identify(angle, torque, sample_rate=RATE, terms=[REFLEX, tvident.Term("reflex.delay", np.copysign)])
