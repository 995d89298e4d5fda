"""Mechanisms: equations from energies."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from merged.simulated import double_pendulum, noisy

identify: Any = tvident.identify
"""Its type is that of a single record."""

FRICTION: dict[str, Any] = {
    "terms": ["offset", "coulomb"],
    "damping": tvident.Matrix("diagonal", "constant"),
    "dof_axis": 0,
}


def pendulum(**options: Any) -> tvident.Mechanism:
    """Give a double pendulum whose second angle is relative to the first."""
    return tvident.Mechanism(
        kinetic={
            "A": lambda _, v: v[0] ** 2 / 2,
            "I2": lambda _, v: (v[0] + v[1]) ** 2 / 2,
            "h": lambda q, v: np.cos(q[1]) * v[0] * (v[0] + v[1]),
        },
        potential={"g1": lambda q: -np.cos(q[0]), "g2": lambda q: -np.cos(q[0] + q[1])},
        **options,
    )


def explained(found: Any) -> Any:
    """Give the share of every torque's variance that the equations explain."""
    _, recorded, predicted = found.predicted_torque()
    left = np.nanvar(recorded - predicted, axis=1)
    return 1 - left / np.nanvar(recorded, axis=1)


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_double_pendulum_has_the_factors_that_it_was_made_with(seed: int) -> None:
    simulated = double_pendulum(6000, seed=seed)
    # A joint on which no force acts obeys its equation too; gravity is known.
    known = pendulum(kinds={"g1": simulated.factors["g1"]})
    found = identify(simulated.angle, simulated.torque, t=simulated.time, structure=known, **FRICTION)
    for name, true in simulated.factors.items():
        if name == "g1":
            assert found.kinds[name] == "known"
            continue
        value, error = found.constants[name]
        assert abs(value - true) < 4 * error, name
        assert abs(value / true - 1) < (0.01 if name in "A I2 h g2" else 0.25), name
    scan = found.scan()
    assert scan.plateau is not None
    assert scan.plateau[0] <= found.settings["window_length"][0] <= scan.plateau[1] > 2 * scan.plateau[0]
    assert not found.record_status & tvident.Status.SCALES_DISAGREE
    assert (explained(found) > 0.99).all()
    assert (found.held_back().predicted > 99).all()
    verdict, held_back = found.summary().splitlines()[:2]
    assert re.match("A known to ± .*, h ± .*, model explains 99.* of the torque", verdict)
    assert held_back.startswith("explains 99")
    A, I2, h = (simulated.factors[name] for name in ("A", "I2", "h"))
    bent = np.cos(np.interp(found.time, simulated.time, simulated.angle[1]))
    moving = [[A + I2 + 2 * h * bent, I2 + h * bent], [I2 + h * bent, np.full(bent.size, I2)]]
    # Where the angle turns fast, straight lines between its samples are off by more.
    assert np.median(np.abs(found.inertia / moving - 1)) < 0.003
    with pytest.raises(ValueError, match="linear equations"):
        _ = found.modes


def test_weights_go_with_times_that_jitter() -> None:
    one = double_pendulum(6000, seed=1)
    loud, rng = np.arange(6000) >= 3000, np.random.default_rng(5)
    torque = np.where(loud, noisy(rng, one.torque, 0.5), one.torque)
    weights = np.where(loud, 0.03**2 / (0.03**2 + 0.5**2), 1.0)
    call: dict[str, Any] = {"structure": pendulum(), **FRICTION}
    plain, found = (identify(one.angle, torque, t=one.time, weights=each, **call) for each in (None, weights))
    quiet = identify(one.angle[:, ~loud], torque[:, ~loud], t=one.time[~loud], **call)
    for name, true in one.factors.items():
        value, error = found.constants[name]
        assert abs(value - true) < 4 * error, name
        assert error < 0.5 * plain.constants[name][1], name
        assert error < 1.2 * quiet.constants[name][1], name


def test_the_double_pendulum_that_was_recorded(folder_of_recordings: Path) -> None:
    path = folder_of_recordings / "double_pendulum.csv"
    if not path.exists():
        pytest.skip(f"the recording {path.name} is missing from {folder_of_recordings}")
    recording = np.loadtxt(path, delimiter=",", skiprows=1).T
    found = identify(recording[1:3], recording[3:], t=recording[0], structure=pendulum(), **FRICTION)
    # As published with the recording, by a fit of another kind (design C.1).
    published = {"A": 0.0569, "I2": 0.0509, "h": 0.0320, "g1": 2.254, "g2": 1.569}
    for name, value in published.items():
        assert abs(found.constants[name][0] / value - 1) < 0.08, name
        assert 0.01 < found.constants[name][1] / value < 0.05
    assert (explained(found) > 0.95).all()
    # The controller feeds noise of the angles back, so that narrow test functions are wrong by a factor.
    assert found.scan().plateau[0] > 150


def test_forces_of_ones_own_and_factors_that_energies_share() -> None:
    t = np.arange(4000) / 500
    rng = np.random.default_rng(0)
    q = np.sin(2 * np.pi * np.outer([0.7, 1.1, 1.9], t) + rng.uniform(0, 6, (3, 1))).sum(0, keepdims=True)
    v, a = np.gradient(q, t, axis=1), np.gradient(np.gradient(q, t, axis=1), t, axis=1)
    mass, drag, length = 2.0, 0.3, 0.5
    torque = mass * length**2 * a + mass * 9.81 * length * np.sin(q) + drag * v * np.abs(v)
    structure = tvident.Mechanism(
        kinetic={"mass": lambda _, v: length**2 * v[0] ** 2 / 2},
        potential={"mass": lambda q: -9.81 * length * np.cos(q[0])},
        forces={"drag": lambda _, v: (v[0] * np.abs(v[0]),)},
    )
    found = identify(q, torque, sample_rate=500, structure=structure, dof_axis=0)
    assert found.constants["mass"][0] == pytest.approx(mass, rel=1e-3)
    assert found.constants["drag"][0] == pytest.approx(drag, rel=1e-2)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"kinetic": {}}, ValueError, "must have an energy"),
        ({"kinetic": {"torque": lambda _, v: v[0]}}, ValueError, "must be its own"),
        ({"kinetic": {"m": 3.0}}, TypeError, "callable"),
        ({"kinetic": {"m": lambda _, v: v[0] ** 2}, "kinds": {"k": 1.0}}, ValueError, "must name elements"),
        ({"kinetic": {"m": lambda _, v: v}}, ValueError, r"shape \(500,\)"),
        ({"kinetic": {"m": lambda _, v: v[0]}, "forces": {"f": lambda _, v: v[:, :7]}}, ValueError, "for each mass"),
    ],
)
def test_what_is_no_mechanism_is_refused(options: dict[str, Any], error: type[Exception], message: str) -> None:
    channels = np.random.default_rng(0).standard_normal((2, 2, 500))
    with pytest.raises(error, match=message):
        identify(*channels, sample_rate=500, dof_axis=0, structure=tvident.Mechanism(**options))
