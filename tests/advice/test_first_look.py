"""A first look at what may be missing: cheap, of every term, and of several together."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import tvident
from tvident._identify.first_look import FirstLook

INERTIA, DAMPING, STIFFNESS = 0.035, 0.36, 38.7
RATE = 1000.0


def test_what_explains_most_comes_first_and_others_beside_it() -> None:
    left = {(): 4.0, ("a",): 1.0, ("b",): 3.0, ("c",): 3.9, ("a", "b"): 0.99, ("a", "c"): 0.1, ("a", "c", "b"): 0.05}
    look = FirstLook(lambda names: left.get(names, np.inf))
    assert look.tells
    assert look.seen(["c", "b", "a"]) == ["a", "b"]
    assert look.seen(["a", "b", "c"], ("a",)) == ["c"]
    assert look.together(["a", "b", "c"]) == ("a", "c", "b")
    assert look.together(["b"]) == ("b",)


@pytest.mark.parametrize("nothing", [np.nan, np.inf, 0.0])
def test_a_look_that_is_not_possible_tells_nothing(nothing: float) -> None:
    look = FirstLook(lambda names: 1.0 if names else nothing)
    assert not look.tells


def swept(drag: float, lag: int = 0) -> tuple[Any, Any]:
    """Give angle and torque of sweeps past a resonance, of which the stiffness jumps by 30 %."""
    rng, t = np.random.default_rng(3), np.arange(12_000) / RATE
    resonance = np.sqrt(STIFFNESS / INERTIA)
    omega = resonance * (1.35 - 1.25 * np.cos(2 * np.pi * t / 5))
    phase = resonance * (1.35 * t - 1.25 * 5 / (2 * np.pi) * np.sin(2 * np.pi * t / 5))
    growth = resonance * 1.25 * (2 * np.pi / 5) * np.sin(2 * np.pi * t / 5)
    angle, velocity = 0.05 * np.sin(phase), 0.05 * omega * np.cos(phase)
    acceleration = 0.05 * (growth * np.cos(phase) - omega**2 * np.sin(phase))
    stiffness = STIFFNESS * (1 + 0.3 * (np.sin(2 * np.pi * t / 4.1) > 0))
    torque = INERTIA * acceleration + DAMPING * velocity + stiffness * angle + drag * velocity * np.abs(velocity)
    torque = np.concatenate([np.full(lag, torque[0]), torque[: t.size - lag]])
    angle = angle + 1e-3 * angle.std() * rng.standard_normal(t.size)
    return angle, torque + 1e-2 * torque.std() * rng.standard_normal(t.size)


@pytest.mark.parametrize(("drag", "lag"), [(0.1, 0), (0.03, 0), (0.1, 3)])
def test_a_drag_that_nothing_suspects_is_found_beside_a_stiffness_that_jumps(drag: float, lag: int) -> None:
    """Of a sweep inertia and damping that change took its place: it was not named, or a lag alone was, and a weak one was believed."""
    angle, torque = swept(drag, lag)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert result.summary().startswith("do not trust")
    advice = next(line for line in result.advice if "quadratic_drag" in line)
    given = re.search(r"lag=([-+.e0-9]+)", advice)
    late = float(given[1]) if given else 0.0
    assert late * RATE == pytest.approx(lag, abs=0.1)
    kinds: dict[str, Any] = {name: "constant" for name in ("inertia", "damping") if f"{name}='constant'" in advice}
    followed = tvident.identify(angle, torque, sample_rate=RATE, terms=["offset", "quadratic_drag"], lag=late, **kinds)
    for name, truth in (("quadratic_drag", drag), ("inertia", INERTIA), ("damping", DAMPING)):
        value, error, *_ = followed.value(name)
        assert value == pytest.approx(truth, abs=4 * error + 0.01 * truth), name


def test_of_a_sweep_without_drag_none_is_found() -> None:
    result = tvident.identify(*swept(0.0), sample_rate=RATE)
    assert result.summary().startswith("K(t) known to")
    assert not any("quadratic_drag" in line for line in result.advice)


def test_a_part_of_a_record_does_not_tell_what_is_constant_elsewhere() -> None:
    """The busiest part tells the lag; the stiffness jumps behind it, and was advised as constant."""
    rng, t = np.random.default_rng(0), np.arange(40_000) / RATE
    waves = [(2 * np.pi * one, rng.uniform(0, 2 * np.pi)) for one in np.linspace(0.8, 24, 40)]
    size = np.where(t < 28, 0.01, 0.005)
    angle = size * sum(np.sin(omega * t + phase) for omega, phase in waves)
    velocity = size * sum(omega * np.cos(omega * t + phase) for omega, phase in waves)
    acceleration = size * sum(-(omega**2) * np.sin(omega * t + phase) for omega, phase in waves)
    stiffness = np.where(t < 28, 50.0, 75.0)
    torque = 0.02 * acceleration + 0.2 * velocity + stiffness * angle
    torque = np.concatenate([torque[:2], torque[:-2]]) + 1e-3 * torque.std() * rng.standard_normal(t.size)
    angle = angle + 1e-4 * angle.std() * rng.standard_normal(t.size)
    advice = next(line for line in tvident.identify(angle, torque, sample_rate=RATE).advice if "lag=" in line)
    given = re.search(r"lag=([-+.e0-9]+)", advice)
    assert given is not None
    assert float(given[1]) * RATE == pytest.approx(2, abs=0.05)
    assert "stiffness='constant'" not in advice
