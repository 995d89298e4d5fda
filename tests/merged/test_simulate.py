"""Simulation of what trials, masses and mechanisms share."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged.simulated import chain, double_pendulum, simulated
from merged.test_masses import CONSTANTS, OPTIONS, changing, constant, springs
from merged.test_mechanisms import FRICTION, pendulum
from tvident import _core
from tvident._merged.not_linear import General, NotLinear
from tvident._merged.response import LinearMasses

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

FORM = tvident.WeakForm(window_length=41, exponent=8)


def not_linear(matrices: tuple[Array, Array, Array], samples: int, friction: float = 0.0, **options: Any) -> NotLinear:
    """Give equations whose matrices are constant, and the same dry friction everywhere."""
    inertia, damping, stiffness = (np.repeat(one[:, :, np.newaxis], samples - 1, 2) for one in matrices)
    count, terms, held = len(inertia), options.get("terms", []), options.get("held")
    equations = General(inertia, damping, stiffness, terms, 1e-3, None, {}, np.ones(count))
    return NotLinear(equations, np.full((count, samples - 1), friction), np.zeros((count, samples)), held, 1e-3)


def test_steps_are_the_exact_response_where_equations_are_linear() -> None:
    rng = np.random.default_rng(0)
    samples = 200
    stiffness = np.array([[30.0, -18.0], [-18.0, 18.0]])
    matrices = np.array([[0.02, 0.003], [0.003, 0.03]]), 2e-3 * stiffness, stiffness
    forces, held = 0.1 * rng.standard_normal((2, samples)), 0.1 * rng.standard_normal((2, samples - 1))
    state = np.array([[0.01, 0.02], [0.3, -0.2]])
    inertia, damping, springs_of = (np.repeat(one[:, :, np.newaxis], samples, 2) for one in matrices)
    exact, _ = LinearMasses(inertia, damping, springs_of, 1e-3).respond(forces, state, None, held=held)
    steps = not_linear(matrices, samples, held=held)
    # Steps of fourth order of the fastest motion, (0.04 rad)^5/120 each.
    np.testing.assert_allclose(steps.respond(forces, state, None)[0], exact, atol=1e-6 * np.abs(exact).max())
    np.testing.assert_allclose(steps.respond(forces, None, exact)[1], state, atol=1e-5)


def test_dry_friction_of_masses_is_that_of_one_mass() -> None:
    t = np.arange(1000) * 1e-3
    torque = (0.4 * np.sin(2 * np.pi * 1.3 * t) + 0.2 * np.sin(2 * np.pi * 3.1 * t))[np.newaxis]
    one = _core.respond(
        [0.01, 0.01, 2.0],
        [("coulomb", 0.25), ("cubic", 3.0)],
        torque,
        delta=1e-3,
        lag=[0.0],
        bridged=0,
        angle=None,
        initial=[[0.1, 0.0]],
        spans=None,
    )
    cubic = (np.ones(1), np.full(999, 3.0), lambda _time, q, _v: q**3)
    matrices = np.array([[0.01]]), np.array([[0.01]]), np.array([[2.0]])
    moving = not_linear(matrices, 1000, 0.25, terms=[cubic])
    found, _ = moving.respond(torque, np.array([[0.1], [0.0]]), None)
    # A third of the time it sticks; turns and releases are found to a part of a step.
    assert np.mean(np.diff(found[0]) == 0) > 0.2
    np.testing.assert_allclose(found, one.angle.reshape(1, -1), atol=1e-4)


def test_trials_respond_as_they_were_simulated() -> None:
    trials, other = (simulated(3, 1200, changing, seed=seed, angle_noise=1e-4) for seed in (1, 2))
    found = identify(trials.angle, trials.torque, sample_rate=1000, ensemble_axis=0, stiffness="windowed")
    # A tenth of the torques is noise.
    assert (found.vaf() > 99).all()
    assert found.held_back().simulated > 98
    shares = found.vaf(other.angle, other.torque)
    assert shares.shape == (3,)
    assert (shares > 99).all()
    alone = found.vaf(other.angle[1], other.torque[1])
    assert alone == pytest.approx(shares[1])
    lengths = (1200, 900)
    angles, torques = ([row[:n] for row, n in zip(rows, lengths, strict=False)] for rows in (other.angle, other.torque))
    assert [one.size for one in found.simulate(torques, angle=angles)] == [1200, 900]
    # The state in which each trial began, where no other is given.
    begun = found.simulate(trials.torque + 0.01)
    np.testing.assert_allclose(begun[:, 0], found.simulate(trials.torque)[:, 0])
    np.testing.assert_allclose(found.simulate(other.torque, (0.1, 0.0))[:, 0], 0.1)
    for options, message in (
        ({"torque": other.torque[0]}, "got 1 trials, where 3"),
        ({"torque": np.tile(other.torque, 2), "initial": (0.0, 0.0)}, "at most the record's 1200 samples"),
        ({"torque": other.torque, "initial": (0.0,)}, "initial must have shape"),
        ({"torque": other.torque, "base": other.torque[0], "initial": (0.0, 0.0)}, "base= must go with"),
        ({"torque": other.torque, "phase": other.torque, "initial": (0.0, 0.0)}, "phase= must go with"),
    ):
        with pytest.raises(ValueError, match=message):
            found.simulate(**options)
    trials.torque[:] = 0.0
    with pytest.raises(ValueError, match="hold other samples by now"):
        found.vaf()


def _turning(turns: float, t: Array) -> Array:
    return np.asarray(15 + 4 * np.sin(turns * t))


def test_trials_along_a_phase_respond_along_it() -> None:
    angles, torques, phases = [], [], []
    for seed, samples in enumerate((640, 600, 560, 520)):
        turns = 2 * np.pi * 1000 / samples
        one = simulated(1, samples, partial(_turning, turns), seed=seed, angle_noise=1e-4)
        angles.append(one.angle[0])
        torques.append(one.torque[0])
        phases.append(np.arange(samples) / samples)
    found = identify(angles, torques, phase=phases, sample_rate=1000, ensemble_axis=0)
    assert (found.vaf() > 99).all()
    assert found.vaf(angles[3], torques[3], phase=phases[3]) == pytest.approx(found.vaf()[3])
    with pytest.raises(ValueError, match="got a part of one; simulate with the whole"):
        found.between(0.1, 0.2).vaf(angles[3], torques[3], phase=phases[3])
    with pytest.raises(ValueError, match="give phase="):
        found.vaf(angles[3], torques[3])


def test_a_base_that_moves_drives_what_is_simulated() -> None:
    one, other = (chain([constant(12.0), constant(18.0)], n, seed=n, base=True, angle_noise=1e-4) for n in (4000, 1500))
    structure = tvident.Chain(2, springs(2), base=one.base)
    found = identify(one.angle, one.torque, structure=structure, method=FORM, **CONSTANTS, **OPTIONS)
    assert (found.vaf() > 99.9).all()
    left = 100 - found.vaf(other.angle, other.torque, base=other.base)
    assert (left < 0.1).all()
    assert (100 - found.vaf(other.angle, other.torque, base=np.zeros(1500)) > 5 * left).all()
    with pytest.raises(ValueError, match="give the base of these torques"):
        found.vaf(other.angle, other.torque)


@pytest.mark.slow
def test_terms_of_masses_are_simulated() -> None:
    one = chain([constant(12.0), constant(18.0)], 2000, seed=11, angle_noise=1e-4)
    drag = tvident.Term("drag", lambda _t, _angle, velocity: velocity * np.abs(velocity))
    structure = tvident.Chain(2, springs(2))
    options = {"structure": structure, "method": FORM, **CONSTANTS, **OPTIONS}
    # What the term takes is added to the torque, so that it is there to be found.
    torque = one.torque + 5.0 * one.angle**3
    found = identify(one.angle, torque, terms=["offset", "cubic", "coulomb", drag], **options)
    shown = slice(0, 250)
    assert (found.vaf(one.angle[:, shown], torque[:, shown]) > 99).all()
    late = tvident.Term("late", lambda t, angle, _velocity: np.interp(t - 0.01, t, angle))
    found = identify(one.angle, torque, terms=["offset", late], **options)
    with pytest.raises(ValueError, match="function of one sample"):
        found.vaf(one.angle[:, shown], torque[:, shown])
    copied = torque[:, shown].copy()
    copied[0, 100:110] = np.nan
    with pytest.raises(ValueError, match="10 missing samples in a row of channel 0"):
        found.vaf(one.angle[:, shown], copied)


@pytest.mark.slow
def test_a_mechanism_responds_as_it_was_simulated() -> None:
    one = double_pendulum(2000, seed=1)
    found = identify(one.angle, one.torque, t=one.time, structure=pendulum(), **FRICTION)
    shown = slice(0, 250)
    # Its joints stick and break away; straight lines stand for torques of up to 4 Hz within 2 ms.
    assert (found.vaf(one.angle[:, shown], one.torque[:, shown]) > 99.9).all()
    assert not found.held_back().simulated.size
