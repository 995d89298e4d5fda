"""Clocks that are aligned: wherever the stiffness varies, and drifts that nobody asked for."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Status
from tvident._identify.aligned import _coarse

Array = npt.NDArray[np.float64]

RATE = 1000.0
CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}


class Moved:
    """A motion of several frequencies, known at any time, of a system whose stiffness swings by a part of it."""

    def __init__(self, seed: int, swing: float, fastest: float = 12.0) -> None:
        self.generator = np.random.default_rng(seed)
        count = 12
        self.speeds = 2 * np.pi * self.generator.uniform(0.3, fastest, count)
        self.sizes = self.generator.uniform(0.3, 1, count) / (1 + (self.speeds / 25) ** 2)
        self.phases = self.generator.uniform(0, 2 * np.pi, count)
        self.swing, self.pace = swing, 2 * np.pi * self.generator.uniform(0.05, 0.6)

    def angle(self, t: Array, noise: float = 0.0) -> Array:
        """Return the angle with noise of a part of it."""
        return self._with(noise, self._sum(t, self.sizes))

    def torque(self, t: Array, noise: float = 0.0) -> Array:
        """Return the torque with noise of a part of it."""
        inert = self._sum(t, -0.01 * self.speeds**2 * self.sizes)
        damped = self._sum(t, 0.05 * self.speeds * self.sizes, np.pi / 2)
        stiff = 15 * (1 + self.swing * np.sin(self.pace * t)) * self._sum(t, self.sizes)
        return self._with(noise, inert + damped + stiff)

    def _sum(self, t: Array, sizes: Array, ahead: float = 0.0) -> Array:
        found = np.zeros(t.size)
        for speed, size, phase in zip(self.speeds, sizes, self.phases, strict=True):
            found += size * np.sin(speed * t + phase + ahead)
        return found

    def _with(self, noise: float, values: Array) -> Array:
        return np.asarray(values + noise * values.std() * self.generator.standard_normal(values.size))


def test_a_stiffness_that_varies_aligns_nothing_wrongly() -> None:
    away = []
    for seed in range(40):
        moved = Moved(seed, 0.6, fastest=6.0)
        t = np.arange(10_000) / RATE
        found, _ = _coarse(moved.angle(t, 1e-3), moved.torque(t - 0.03, 0.01))
        away.append(abs(found - 30))
    # With constants alone several of 40 were hundreds of samples away.
    assert max(away) < 25


@pytest.mark.parametrize("seed", [45, 63, 69])
def test_a_stiffness_that_may_vary_does_not_follow_a_drift(seed: int) -> None:
    moved = Moved(seed, 0.0, fastest=3.0)
    t = np.arange(20_000) / RATE
    found, _ = _coarse(moved.angle(t, 2e-4), moved.torque(t - 0.01 - 8e-4 * t, 0.01))
    # Late by 10 to 26 samples; with a stiffness that varies alone it was 49 to 52.
    assert abs(found - 18) < 25


@pytest.mark.parametrize("drift", [1e-4, -3e-5])
def test_a_drift_that_nobody_asked_for_is_said(drift: float) -> None:
    moved = Moved(1, 0.0)
    t = np.arange(10_000) / RATE
    angle, torque = moved.angle(t, 1e-3), moved.torque(t, 0.01)
    found = tvident.identify(angle, torque, t=(t, t + 0.02 + drift * t), align="offset", **CONSTANT)
    (words,) = (one for one in found.advice if "run at different speeds" in one)
    said_of = re.search(r"become (\S+) ± (\S+) s", words)
    assert said_of is not None
    assert abs(float(said_of[1]) - abs(drift)) < 4 * float(said_of[2])
    assert ("later" if drift > 0 else "earlier") in words
    assert "align='drift'" in words
    assert found.record_status & Status.CHANNEL_SUSPECTED
    said = tvident.identify(angle, torque, t=(t, t + 0.02 + drift * t), align="drift", **CONSTANT)
    assert not any("run at different speeds" in one for one in said.advice)


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_clocks_of_one_speed_are_not_said_to_drift(seed: int) -> None:
    moved = Moved(seed, 0.2 * (seed == 4))
    t = np.arange(10_000) / RATE
    found = tvident.identify(moved.angle(t, 1e-3), moved.torque(t, 0.01), t=(t, t + 0.02), align="offset")
    assert not any("run at different speeds" in one for one in found.advice)
