"""Terms of joints that windows follow, or where no torque acts: named, and their change in the errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged.simulated import chain, drive, noisy
from parameters import long
from tvident import Chain, Status

Array = npt.NDArray[np.float64]

RATE, SECONDS = 500.0, 20.0

SHAPES: dict[str, Any] = {
    "coulomb": lambda _, speed: np.tanh(speed / (0.02 * speed_of(speed))),
    "cubic": lambda angle, _: angle**3,
    "quadratic_drag": lambda _, speed: speed * abs(speed),
}


def speed_of(_: Any) -> float:
    """Give a usual velocity of the joint."""
    return 0.5


@dataclass(frozen=True)
class Record:
    """A chain whose last joint has a term: channels with noise, and its true elements."""

    angle: Array
    torque: Array
    true: dict[str, float]


# Two masses or three, of which one is driven.
@cache
def record(term: str, factor: float, masses: int, driven: int, seed: int) -> Record:
    rng = np.random.default_rng(seed)
    step = 1 / RATE
    samples = int(SECONDS * RATE)
    inertia, damping = np.linspace(0.02, 0.03, masses), 0.03
    stiffness = np.linspace(12.0, 18.0, masses)
    forces = np.zeros((masses, 2 * samples + 1))
    forces[driven] = 3 * drive(rng, 1, np.arange(2 * samples + 1) * step / 2, 8.0)[0]
    stretched = np.eye(masses) - np.eye(masses, k=-1)
    acts = SHAPES[term]

    def slope(state: Array, force: Array) -> Array:
        angle, speed = stretched @ state[0], stretched @ state[1]
        pull = stiffness * angle + damping * speed
        pull[-1] += factor * acts(angle[-1], speed[-1])
        return np.stack([state[1], (force - stretched.T @ pull) / inertia])

    state, angle = np.zeros((2, masses)), np.empty((masses, samples))
    for sample in range(samples):
        angle[:, sample] = state[0]
        now, half, then = forces[:, 2 * sample : 2 * sample + 3].T
        one = slope(state, now)
        two = slope(state + step / 2 * one, half)
        three = slope(state + step / 2 * two, half)
        state = state + step / 6 * (one + 2 * two + 2 * three + slope(state + step * three, then))
    links = ["base_0", *(f"{mass - 1}_{mass}" for mass in range(1, masses))]
    true = {f"inertia_{mass}": float(one) for mass, one in enumerate(inertia)}
    true |= {f"damping_{link}": damping for link in links}
    true |= {f"stiffness_{link}": float(one) for link, one in zip(links, stiffness, strict=True)}
    return Record(noisy(rng, angle, 1e-3), noisy(rng, forces[:, :-1:2], 0.1), true)


def identified(one: Record, terms: Any = (), **options: Any) -> Any:
    masses = len(one.angle)
    springs: list[Any] = [("base" if mass == 0 else mass - 1, mass) for mass in range(masses)]
    structure = Chain(masses, springs, terms=terms)
    return tvident.identify(one.angle, one.torque, structure=structure, sample_rate=RATE, dof_axis=0, **options)


def worst(found: Any, one: Record) -> float:
    """Give the largest error of an element, the root of its mean square over that of its standard errors."""
    errors = {
        name: np.sqrt(np.nanmean((found.elements[name] - true) ** 2) / np.nanmean(found.stderr[name] ** 2))
        for name, true in one.true.items()
    }
    return float(max(errors.values()))


CASES = [
    ("quadratic_drag", 0.01, 2, 1),
    # Too little for a first look: 3.2 errors off, without a word.
    ("coulomb", 0.002, 2, 1),
    *long(("quadratic_drag", 0.02, 2, 0), ("coulomb", 0.005, 2, 1), ("coulomb", 0.01, 2, 0), ("cubic", 30.0, 2, 1)),
]


@pytest.mark.parametrize(("term", "factor", "masses", "driven"), CASES)
def test_a_term_that_windows_of_its_joint_follow_is_named(term: str, factor: float, masses: int, driven: int) -> None:
    """Windows of the joint's damping followed drag: it was trusted and 4 to 27 errors off, without a word in a fourth of the records."""
    one = record(term, factor, masses, driven, 1)
    windows: Any = {(0, 1): "windowed"}
    found = identified(one, damping=windows)
    assert found.record_status & Status.TERM_SUSPECTED
    assert any(f"terms=[('{term}', (0, 1))" in line for line in found.advice), found.advice
    assert worst(found, one) < 3
    cured = identified(one, [(term, (0, 1))], damping=windows)
    assert cured.trusted.all()
    assert not cured.record_status & Status.TERM_SUSPECTED
    assert worst(cured, one) < 3


@pytest.mark.parametrize(
    ("term", "factor"), [("cubic", 100.0), *long(("cubic", 30.0), ("quadratic_drag", 0.02), ("coulomb", 0.02))]
)
def test_a_term_of_a_joint_far_from_every_torque_is_named(term: str, factor: float) -> None:
    """No torque acts on either end: half of such records were trusted and wrong."""
    one = record(term, factor, 3, 0, 2)
    found = identified(one)
    assert any(f"terms=[('{term}', (1, 2))" in line for line in found.advice), found.advice
    assert worst(found, one) < 3
    cured = identified(one, [(term, (1, 2))])
    assert cured.trusted.all()
    assert worst(cured, one) < 5


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4, 5)])
@pytest.mark.parametrize("driven", [0, *long(1, 2)])
def test_springs_that_change_are_no_terms(driven: int, seed: int) -> None:
    """Where no torque acts windows leave more of equations than noise, which looks like a little of anything."""
    springs = [lambda t: 12 + 3 * np.sin(0.7 * t), lambda t: 18 + 0 * t, lambda t: 15 + 2 * np.sin(1.1 * t + seed)]
    simulated = chain(springs, 12_000, seed=seed, driven=(driven,))
    structure = Chain(3, [("base", 0), (0, 1), (1, 2)])
    found = tvident.identify(simulated.angle, simulated.torque, structure=structure, sample_rate=1000, dof_axis=0)
    assert not found.record_status & Status.TERM_SUSPECTED
    assert not any("terms=" in line for line in found.advice)


def test_settings_of_a_result_that_lacks_a_term_say_so_again(tmp_path: Any) -> None:
    one = record("quadratic_drag", 0.01, 2, 1, 1)
    windows: Any = {(0, 1): "windowed"}
    found = identified(one, damping=windows)
    again = identified(one, settings=found.settings)
    assert again.record_status & Status.TERM_SUSPECTED
    np.testing.assert_array_equal(again.trusted, found.trusted)
    found.save(tmp_path / "result.npz")
    loaded = tvident.load(tmp_path / "result.npz")
    assert loaded.record_status == found.record_status
    assert loaded.advice == found.advice
    np.testing.assert_allclose(loaded.stderr["damping_0_1"], found.stderr["damping_0_1"])
