"""Built-in terms of the equation of motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from built_in_functions import FUNCTIONS
from calls import paper

Array = npt.NDArray[np.float64]

INERTIA, DAMPING, GRAVITY, OFFSET = 0.02, 0.05, 1.5, 0.3


def swings(n: int = 8000) -> tuple[Array, Array]:
    """Give angle and torque of a pendulum that is driven far round: without a spring."""
    t = np.arange(n) / 1000
    angle, velocity, acceleration = np.zeros((3, n))
    for amplitude, frequency, phase in ((1.2, 0.5, 0.3), (0.5, 1.3, 1.0), (0.2, 2.9, 2.0)):
        omega = 2 * np.pi * frequency
        angle += amplitude * np.sin(omega * t + phase)
        velocity += amplitude * omega * np.cos(omega * t + phase)
        acceleration -= amplitude * omega**2 * np.sin(omega * t + phase)
    torque = INERTIA * acceleration + DAMPING * velocity + GRAVITY * np.sin(angle) + OFFSET
    return angle, torque


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_built_in_term_is_like_a_term_of_ones_own(name: str) -> None:
    angle, torque = swings(2000)
    own = tvident.Term("own", FUNCTIONS[name])
    call: dict[str, Any] = {"sample_rate": 1000, "window_length": 51, "regression_window": 400, "stiffness": 0}
    expected = tvident.identify(angle, torque, **paper(terms=[own], **call))
    found = tvident.identify(angle, torque, **paper(terms=[name], **call))
    np.testing.assert_allclose(found.terms[name], expected.terms["own"], rtol=1e-6)


@pytest.mark.parametrize("method", ["auto", tvident.StrongForm(window_length=51)])
def test_gravity_is_found(method: Any) -> None:
    angle, torque = swings()
    generator = np.random.default_rng(0)
    torque = torque + 0.01 * generator.standard_normal(torque.size)
    angle = angle + 1e-5 * generator.standard_normal(angle.size)
    result = tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        method=method,
        inertia="constant",
        damping="constant",
        stiffness=0,
        terms=["gravity", "offset"],
    )
    truth = {"inertia": INERTIA, "damping": DAMPING, "gravity": GRAVITY, "offset": OFFSET}
    for name, true in truth.items():
        value, error = result.constants[name]
        # Six standard errors, and what smoothing of the angle takes from its second derivative in strong form.
        assert abs(value - true) < 6 * error + 1e-3 * true, name
    assert "N m" in result.summary().split("gravity")[1].splitlines()[0]


def test_a_missing_pendulum_is_suspected_or_the_noise_model_fails() -> None:
    angle, torque = swings()
    torque = torque + 0.01 * np.random.default_rng(0).standard_normal(torque.size)
    result = tvident.identify(angle, torque, sample_rate=1000, inertia="constant", damping="constant", stiffness=0)
    assert result.record_status & (tvident.Status.NOISE_MODEL | tvident.Status.TERM_SUSPECTED)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("method", ["auto", tvident.StrongForm(window_length=101)])
@pytest.mark.parametrize("given", [{}, {"stiffness": "constant"}])
def test_a_pendulum_taken_for_a_spring_is_said_with_its_cure(method: Any, given: dict[str, Any]) -> None:
    angle, torque = swings()
    generator = np.random.default_rng(0)
    angle = angle + 1e-4 * generator.standard_normal(angle.size)
    noise = 0.02 * generator.standard_normal(angle.size)
    call: dict[str, Any] = {"sample_rate": 1000, "method": method}
    result = tvident.identify(angle, torque + noise, **call, **given)
    # Inertia that seems to change takes the place of what is missing in one case of four.
    assert result.record_status & (tvident.Status.TERM_SUSPECTED | tvident.Status.NOISE_MODEL)
    advice = result.advice[0]
    assert "gravity of" in advice
    assert "terms=['offset', 'gravity']" in advice
    assert given == {} or "stiffness=0" in advice
    cured = tvident.identify(angle, torque + noise, **call, stiffness=0, terms=["offset", "gravity"])
    assert cured.constants["gravity"][0] == pytest.approx(GRAVITY, rel=0.01)
    assert not cured.record_status & tvident.Status.TERM_SUSPECTED
    spring = torque - GRAVITY * np.sin(angle) + GRAVITY * angle
    batch = tvident.identify([angle, angle], np.stack([torque, spring]) + noise, **call, **given)
    assert batch.record_status[0] == result.record_status
    assert not batch.record_status[1] & tvident.Status.TERM_SUSPECTED
