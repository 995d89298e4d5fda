"""What only looks like a lag of the torque is not named as one, and a true one is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from tvident import Status

RATE = 1000.0
INERTIA, DAMPING, STIFFNESS = 0.05, 0.4, 15.0


def rubbing(friction: float, late: float) -> tuple[Any, Any]:
    """Give angle and torque of a machine whose stiffness changes, with friction that is smooth, and a torque that is late by samples."""
    rng, t = np.random.default_rng(5), np.arange(20_000) / RATE

    def moved(t: Any) -> Any:
        waves = [(2 * np.pi * f, p) for f, p in zip((0.7, 1.3, 2.3, 3.7, 5.1, 7.9), (0, 4, 1, 3, 2, 5), strict=True)]
        angle = sum(0.06 / (1 + w / 20) * np.sin(w * t + p) for w, p in waves)
        velocity = sum(0.06 / (1 + w / 20) * w * np.cos(w * t + p) for w, p in waves)
        acceleration = sum(-0.06 / (1 + w / 20) * w**2 * np.sin(w * t + p) for w, p in waves)
        stiffness = STIFFNESS * (1 + 0.3 * np.sin(2 * np.pi * t / 11))
        torque = INERTIA * acceleration + DAMPING * velocity + stiffness * angle
        return angle, torque + friction * np.tanh(velocity / 0.5)

    angle, torque = moved(t)[0], moved(t - late / RATE)[1]
    return tuple(one + 1e-3 * one.std() * rng.standard_normal(t.size) for one in (angle, torque))


@pytest.mark.parametrize(("friction", "late"), [(0.1, 0.0), (0.0, 0.8), (0.0, -0.1)])
def test_smooth_friction_is_no_lag(friction: float, late: float) -> None:
    """Most of such a lag is gone beside dry friction and drag, which do not change a true one."""
    angle, torque = rubbing(friction, late)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert bool(result.record_status & Status.LAG_SUSPECTED) == (friction == 0)
    assert any("lag=" in line for line in result.advice) == (friction == 0)


def stepped(synchronous: bool) -> tuple[Any, Any]:
    """Give angle and torque of a machine that is driven in steps, at samples or anywhere between them, without noise."""
    rng, t = np.random.default_rng(8), np.arange(10_000) / RATE
    natural, decay = np.sqrt(STIFFNESS / INERTIA), DAMPING / (2 * INERTIA)
    damped = np.sqrt(natural**2 - decay**2)
    angle, torque = np.zeros((2, t.size))
    for place, begin in enumerate(np.cumsum(rng.uniform(0.2, 0.5, 26))):
        when = round(begin * RATE) / RATE if synchronous else begin
        later = np.maximum(t - when, 0.0)
        swing = np.cos(damped * later) + decay / damped * np.sin(damped * later)
        height = (1.0 if place == 0 else 2.0) * (-1) ** place
        angle += height / STIFFNESS * (1 - np.exp(-decay * later) * swing)
        torque += height * (t >= when - 1e-9)
    return angle, torque


@pytest.mark.parametrize("synchronous", [False, True])
def test_steps_between_samples_tell_no_lag(synchronous: bool) -> None:
    """A step between two samples may have been anywhere between them; one at a sample is half a sample early, as every other is."""
    result = tvident.identify(*stepped(synchronous), sample_rate=RATE)
    assert bool(result.record_status & Status.LAG_SUSPECTED) == synchronous
    assert any("the torque" in line and "early" in line for line in result.advice) == synchronous


@pytest.mark.parametrize("synchronous", [False, True])
def test_a_lag_that_is_found_knows_that_steps_may_lie_anywhere(synchronous: bool) -> None:
    """So many steps, each anywhere between two samples, tell a lag no better than their mean place."""
    angle, torque = stepped(synchronous)
    constant: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    result = tvident.identify(angle, torque, sample_rate=RATE, lag="auto", **constant)
    late, error = (RATE * result.settings[name] for name in ("lag", "lag_stderr"))
    of_steps = np.sqrt(1 / (12 * np.count_nonzero(np.diff(torque))))
    # Steps tell about as much each as the others: twice as much or half at most.
    assert of_steps / 2 < error < 2 * of_steps
    assert abs(late + 0.5 * synchronous) < 4 * error
    # What is identified with the lag of this torque needs no other: those errors stay.
    assert result.value("inertia").stderr < 1e-3 * INERTIA


@pytest.mark.parametrize(("late", "is_told"), [(0.01, False), (0.1, True)])
def test_a_lag_of_next_to_nothing_is_not_told_but_held(late: float, is_told: bool) -> None:
    """Recorders sample their channels a hundredth of a sample apart: where no parameter changes by a hundredth, errors hold that."""
    t = np.arange(10_000) / RATE
    waves = [(2 * np.pi * f, p) for f, p in zip((0.7, 1.3, 2.3, 3.7, 5.1), (0, 4, 1, 3, 2), strict=True)]

    def summed(order: int, t: Any) -> Any:
        phases = [w * t + p + order * np.pi / 2 for w, p in waves]
        return np.sum(
            [0.06 / (1 + w / 20) * w**order * np.sin(phase) for (w, _), phase in zip(waves, phases, strict=True)],
            axis=0,
        )

    then = t - late / RATE
    rng = np.random.default_rng(6)
    torque = INERTIA * summed(2, then) + DAMPING * summed(1, then) + STIFFNESS * summed(0, then)
    angle = summed(0, t)
    noisy = [one + 2e-6 * one.std() * rng.standard_normal(t.size) for one in (angle, torque)]
    result = tvident.identify(*noisy, sample_rate=RATE, inertia="constant", damping="constant", stiffness="constant")
    assert bool(result.record_status & Status.LAG_SUSPECTED) == is_told
    assert any("lag=" in line for line in result.advice) == is_told
    damping = result.value("damping")
    assert is_told or abs(damping.value - DAMPING) < 3 * damping.stderr
