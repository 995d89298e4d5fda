"""Simulated trials and masses: a spring that changes, any force, a classic Runge-Kutta."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FINER = 1
"""Steps of the integration within a sample."""
PIECE = 2000
"""Steps that are prepared at once."""


@dataclass(frozen=True)
class Trials:
    """Channels with noise, and the truth."""

    angle: Array
    torque: Array
    stiffness: Array
    inertia: float = 0.0123
    damping: float = 0.008


def drive(rng: np.random.Generator, channels: int, times: Array, highest: float = 25.0) -> Array:
    """Give multisines of random phases, shape (channels, times)."""
    frequencies = np.linspace(0.5, highest, 31)
    phases = rng.uniform(0, 2 * np.pi, (channels, frequencies.size))
    return np.stack([np.sin(2 * np.pi * np.outer(times, frequencies) + one).sum(axis=1) for one in phases]) * 0.05


def integrated(stiffness: Array, damping: Array, inverse: Array, forces: Array, state: Array, step: float) -> Array:
    """Give angles (masses, trials, n) of masses: stiffness (masses, masses) and forces (masses, trials) at half steps, the last axis.

    The equation is linear, so that a step of Runge and Kutta is a matrix times the state and what the forces add, for all steps at once.
    """
    masses, trials, halves = forces.shape
    steps = halves // 2
    places = np.empty((steps + 1, 2 * masses, trials))
    places[0] = state
    for first in range(0, steps, PIECE):
        last = min(first + PIECE, steps)
        part = slice(2 * first, 2 * last + 1)
        slope = np.zeros((2 * (last - first) + 1, 2 * masses, 2 * masses))
        slope[:, :masses, masses:] = np.eye(masses)
        slope[:, masses:, :masses] = -inverse @ np.moveaxis(stiffness[:, :, part], 2, 0)
        slope[:, masses:, masses:] = -inverse @ damping
        pushed = np.zeros((len(slope), 2 * masses, trials))
        pushed[:, masses:] = inverse @ np.moveaxis(forces[:, :, part], 2, 0)
        now, half, then = slope[:-1:2], slope[1::2], slope[2::2]
        # The slopes of the method as they follow from a state, and from forces.
        two = half + step / 2 * half @ now
        three = half + step / 2 * half @ two
        four = then + step * then @ three
        by_forces = [pushed[:-1:2]]
        by_forces.append(pushed[1::2] + step / 2 * half @ by_forces[0])
        by_forces.append(pushed[1::2] + step / 2 * half @ by_forces[1])
        by_forces.append(pushed[2::2] + step * then @ by_forces[2])
        turned = np.eye(2 * masses) + step / 6 * (now + 2 * two + 2 * three + four)
        added = step / 6 * (by_forces[0] + 2 * by_forces[1] + 2 * by_forces[2] + by_forces[3])
        for place, (turn, more) in enumerate(zip(turned, added, strict=True), first):
            places[place + 1] = turn @ places[place] + more
    return np.moveaxis(places[:steps:FINER, :masses], 0, -1)


def noisy(rng: np.random.Generator, clean: Array, part: float) -> Array:
    return np.asarray(clean + part * clean.std(axis=-1, keepdims=True) * rng.standard_normal(clean.shape))


def simulated(
    trials: int, samples: int, stiffness: Callable[[Array], Array], *, seed: int, angle_noise: float = 1e-3
) -> Trials:
    """Give trials of one mass that share K(t): torque SNR 20 dB."""
    rng = np.random.default_rng(seed)
    step = 1e-3 / FINER
    times = np.arange(2 * samples * FINER + 1) * step / 2
    torque, spring = drive(rng, trials, times), np.asarray(stiffness(times))
    inertia, damping = Trials.inertia, Trials.damping

    state = np.stack([rng.normal(0, 0.02, trials), rng.normal(0, 0.5, trials)])
    one = np.ones((1, 1))
    springs = np.broadcast_to(spring, (1, 1, times.size))
    (angle,) = integrated(springs, damping * one, one / inertia, torque[np.newaxis], state, step)
    whole = slice(0, 2 * FINER * samples, 2 * FINER)
    return Trials(noisy(rng, angle, angle_noise), noisy(rng, torque[:, whole], 0.1), spring[whole])


@dataclass(frozen=True)
class Masses:
    """Channels of a chain with noise, and its true elements."""

    angle: Array
    torque: Array
    base: Array | None
    stiffness: list[Array]
    damping: list[float]
    inertia: list[float]


# All that records of chains may differ in.
def chain(
    stiffness: list[Callable[[Array], Array]],
    samples: int,
    *,
    seed: int,
    driven: tuple[int, ...] | None = None,
    base: bool = False,
    angle_noise: float = 1e-3,
    torque_noise: float = 0.1,
    highest: float = 12.0,
) -> Masses:
    """Give masses in a row, the first held by a spring to the base, a damper beside every spring: torque SNR 20 dB by default."""
    rng = np.random.default_rng(seed)
    masses, step = len(stiffness), 1e-3 / FINER
    times = np.arange(2 * samples * FINER + 1) * step / 2
    inertia = np.linspace(0.02, 0.03, masses)
    damping = np.full(masses, 0.03)
    springs = np.stack([np.broadcast_to(one(times), times.shape) for one in stiffness])
    forces = drive(rng, masses, times, highest)
    if driven is not None:
        forces[[mass for mass in range(masses) if mass not in driven]] = 0.0
    road = 0.01 * drive(rng, 1, times, 4.0)[0] if base else np.zeros(times.size)
    speed = np.gradient(road, step / 2)

    pushed = forces[:, np.newaxis].copy()
    pushed[0, 0] += springs[0] * road + damping[0] * speed
    # How much each spring and damper is stretched by each angle.
    stretched = np.eye(masses) - np.eye(masses, k=-1)
    matrix = np.einsum("ki,kt,kj->ijt", stretched, springs, stretched)
    resisting = stretched.T @ np.diag(damping) @ stretched
    still = np.zeros((2 * masses, 1))
    angle = integrated(matrix, resisting, np.diag(1 / inertia), pushed, still, step)[:, 0]
    whole = slice(0, 2 * FINER * samples, 2 * FINER)
    return Masses(
        noisy(rng, angle, angle_noise),
        noisy(rng, forces[:, whole], torque_noise),
        noisy(rng, road[whole], angle_noise) if base else None,
        list(springs[:, whole]),
        list(damping),
        list(inertia),
    )


@dataclass(frozen=True)
class Coupled:
    """Channels of coupled masses with noise, shape (trials, masses, n), and the true stiffness, shape (masses, masses, n)."""

    angle: Array
    torque: Array
    stiffness: Array


# All that records of masses may differ in.
def coupled(
    stiffness: Callable[[Array], Array],
    inertia: Array,
    damping: Array,
    samples: int,
    *,
    seed: int,
    trials: int = 1,
    driven: tuple[int, ...] | None = None,
    base: tuple[Array, Array] | None = None,
    angle_noise: float = 1e-3,
    highest: float = 12.0,
) -> Coupled:
    """Give trials of masses with any matrices, the stiffness a function of times: torque SNR 20 dB.

    A base that moves is given as its position and its velocity at half samples; it pulls with what rows of the matrices lack to zero.
    """
    rng = np.random.default_rng(seed)
    masses, step = len(inertia), 1e-3 / FINER
    times = np.arange(2 * samples * FINER + 1) * step / 2
    matrix = np.asarray(stiffness(times))
    forces = np.stack([drive(rng, masses, times, highest) for _ in range(trials)], axis=1)
    if driven is not None:
        forces[[mass for mass in range(masses) if mass not in driven]] = 0.0
    inverse = np.asarray(np.linalg.inv(inertia), np.float64)
    pulled = np.zeros((masses, times.size))
    if base is not None:
        pulled = matrix.sum(axis=1) * base[0] + np.outer(damping.sum(axis=1), base[1])

    pushed = forces + pulled[:, np.newaxis]
    angle = integrated(matrix, damping, inverse, pushed, np.zeros((2 * masses, trials)), step).swapaxes(0, 1)
    whole = slice(0, 2 * FINER * samples, 2 * FINER)
    torque = forces[:, :, whole].swapaxes(0, 1)
    return Coupled(noisy(rng, angle, angle_noise), noisy(rng, torque, 0.1), matrix[:, :, whole])


@dataclass(frozen=True)
class Pendulum:
    """Channels of a double pendulum with noise, at times that jitter, and its true factors."""

    time: Array
    angle: Array
    torque: Array
    factors: dict[str, float]


def double_pendulum(samples: int, *, seed: int, noise: float = 1e-4) -> Pendulum:
    """Give a pendulum whose second angle is relative to the first, with viscous and dry friction, moved by torques at both joints.

    The equations are written out here, not derived from energies.
    """
    rng = np.random.default_rng(seed)
    names = ("A", "I2", "h", "g1", "g2", "damping_0_0", "damping_1_1", "coulomb_0", "coulomb_1")
    truth = np.array([0.06, 0.05, 0.03, 2.2, 1.5, 0.03, 0.02, 0.15, 0.1]) * rng.uniform(0.8, 1.2, len(names))
    A, I2, h, g1, g2, b1, b2, c1, c2 = truth
    period = 2e-3
    time = (np.arange(samples) + 0.1 * rng.uniform(-0.5, 0.5, samples)) * period
    middle = np.repeat(time, 2)[1:] / 2 + np.repeat(time, 2)[:-1] / 2
    drives = 30 * drive(rng, 2, middle, 4.0)

    def slope(state: Array, force: Array) -> Array:
        q1, q2, v1, v2 = state
        cosine, sine = h * np.cos(q2), h * np.sin(q2)
        both = g2 * np.sin(q1 + q2)
        left = force[0] + sine * v2 * (2 * v1 + v2) - g1 * np.sin(q1) - both - b1 * v1 - c1 * np.sign(v1)
        right = force[1] - sine * v1**2 - both - b2 * v2 - c2 * np.sign(v2)
        m11, m12 = A + I2 + 2 * cosine, I2 + cosine
        determinant = m11 * I2 - m12**2
        return np.array([v1, v2, (I2 * left - m12 * right) / determinant, (m11 * right - m12 * left) / determinant])

    state, angle = np.zeros(4), np.empty((2, samples))
    for sample in range(samples):
        angle[:, sample] = state[:2]
        if sample + 1 == samples:
            break
        step = time[sample + 1] - time[sample]
        now, half, then = drives[:, 2 * sample : 2 * sample + 3].T
        one = slope(state, now)
        two = slope(state + step / 2 * one, half)
        three = slope(state + step / 2 * two, half)
        state = state + step / 6 * (one + 2 * two + 2 * three + slope(state + step * three, then))
    noisy_angle = angle + noise * rng.standard_normal(angle.shape)
    torque = noisy(rng, drives[:, ::2], 0.03)
    return Pendulum(time, noisy_angle, torque, dict(zip(names, map(float, truth), strict=True)))
