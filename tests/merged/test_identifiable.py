"""Matrices that too few frequencies move: which entries cannot be known, and which can."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged import simulated
from merged.test_masses import CONSTANTS, OPTIONS
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

INERTIA = np.array([[0.025, 0.004], [0.004, 0.02]])
DAMPING = np.array([[0.05, -0.01], [-0.01, 0.04]])
FADED = 9000
"""Samples after which nothing is left of how it began: what rings then would tell more."""


def stiffness(t: Array, swing: float) -> Array:
    """Give the matrix at some times."""
    found = np.broadcast_to(np.array([[30.0, -10.0], [-10.0, 25.0]])[:, :, np.newaxis], (2, 2, t.size)).copy()
    found[0, 0] += swing * np.sin(0.6 * t)
    return found


def moved(
    monkeypatch: pytest.MonkeyPatch, frequencies: list[list[float]], *, seed: int, swing: float = 0.0
) -> tuple[Array, Array]:
    """Give angles and torques of two masses, each with its own frequencies, when they have swung in."""

    def drive(rng: np.random.Generator, channels: int, times: Array, _: float = 0.0) -> Array:
        each = [(np.array(one), rng.uniform(0, 2 * np.pi, len(one))) for one in frequencies[:channels]]
        return np.stack([0.3 * np.sin(2 * np.pi * np.outer(times, f) + phase).sum(axis=1) for f, phase in each])

    monkeypatch.setattr(simulated, "drive", drive)
    found = simulated.coupled(
        lambda t: stiffness(t, swing), INERTIA, DAMPING, FADED + 8000, seed=seed, angle_noise=1e-3
    )
    return found.angle[0][:, FADED:], found.torque[0][:, FADED:]


def entries(name: str) -> list[str]:
    return [f"{name}_{i}_{j}" for i in range(2) for j in range(2)]


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
@pytest.mark.parametrize("frequencies", [[[3.0], [3.0]], [[2.0], [5.0]]])
def test_two_frequencies_do_not_tell_whole_matrices_apart(
    monkeypatch: pytest.MonkeyPatch, frequencies: list[list[float]], seed: int
) -> None:
    angle, torque = moved(monkeypatch, frequencies, seed=seed)
    found = identify(angle, torque, **CONSTANTS, **OPTIONS)
    for name in (*entries("inertia"), *entries("stiffness")):
        assert not found.identifiable[name], name
        assert "by no more than noise" in found.identifiable[name].reason
        assert np.isnan(found.elements[name]).all()
        assert found.kinds[name] == "unknown"
        assert f"{name} cannot be known: the motion tells it from " in found.summary()
    assert found.record_status & Status.RANK_DEFICIENT
    assert not found.trusted.any()
    # An offset has nothing to do with them.
    assert all(found.identifiable[f"offset_{mass}"] for mass in range(2))
    assert found.summary().startswith("do not trust: ")


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
def test_windows_that_one_frequency_moves_are_said_to_be_too_short(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    angle, torque = moved(monkeypatch, [[3.0], [3.0]], seed=seed, swing=3.0)
    kinds = {"inertia": "constant", "damping": "constant", "stiffness": "windowed"}
    found = identify(angle, torque, **kinds, **OPTIONS)
    for name in entries("stiffness"):
        assert not found.identifiable[name], name
        assert "within windows of" in found.identifiable[name].reason


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
@pytest.mark.parametrize("swing", [0.0, 3.0])
@pytest.mark.parametrize("frequencies", [[[2.0, 4.0, 7.0]] * 2, [[2.0, 5.0], [3.0, 6.0]]])
def test_enough_frequencies_do(
    monkeypatch: pytest.MonkeyPatch, frequencies: list[list[float]], swing: float, seed: int
) -> None:
    angle, torque = moved(monkeypatch, frequencies, seed=seed, swing=swing)
    kinds = {"inertia": "constant", "damping": "constant", "stiffness": "windowed" if swing else "constant"}
    found = identify(angle, torque, **kinds, **OPTIONS)
    truth = stiffness(found.time + FADED / 1000, swing)
    assert not np.nanmax(np.abs(found.stiffness - truth)) > 2
    # Of seed 3 windows of 64 samples predict best where the first mass moves at two frequencies, and do not tell its entries apart.
    fails = (seed, swing, frequencies[0]) == (3, 3.0, [2.0, 5.0])
    assert all(found.identifiable[name] for name in entries("stiffness")) != fails
