"""Records of a controlled oscillator: noise of the measured angle is fed back into the torque."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

Array = npt.NDArray[np.float64]

TRUTH = {"inertia": 0.01, "damping": 0.05, "stiffness": 10.0}
RATE = 1000.0

HELD = 50
"""Samples over which a stiffness that swings stays the same."""


def closed_loop(
    seeds: range,
    *,
    angle_noise: float = 1e-2,
    torque_noise: float = 2e-3,
    n: int = 20_000,
    growth: float = 0.0,
    swing: tuple[float, float] = (0.0, 1.0),
) -> tuple[Array, Array, Array]:
    """Give angle, torque and reference of one record a seed: T = 5 (reference - angle) - 0.05 velocity, both as measured.

    The torque is linear between samples, so the controller's value at a sample acts on the motion from the sample before. In the second
    half of the record the stiffness is larger by the part `growth`; or it swings by a part, at a frequency.
    """
    period, t = 1 / RATE, np.arange(n) / RATE
    inertia, damping, stiffness = TRUTH.values()
    # Angle, velocity, torque and its rate.
    system = np.zeros((4, 4))
    system[0, 1] = 1
    system[1, :3] = [-stiffness / inertia, -damping / inertia, 1 / inertia]
    system[2, 3] = 1
    step = expm(system * period)
    system[1, 0] *= 1 + growth
    later = expm(system * period)
    generators = [np.random.default_rng(seed) for seed in seeds]
    noise, own = (
        size * np.stack([one.standard_normal(n) for one in generators]) for size in (angle_noise, torque_noise)
    )
    frequencies = (0.5, 1.3, 2.9, 4.7, 7.1, 9.3)
    reference = np.stack(
        [sum(0.2 * np.sin(2 * np.pi * f * t + one.uniform(0, 6.28)) for f in frequencies) for one in generators]
    )
    angle, torque = np.zeros((2, len(generators), n))
    x, v, last, speed = np.zeros((4, len(generators)))
    before = np.zeros(len(generators))
    for k in range(n):
        # A controller that is one sample late: its torque begins at the sample before, and is linear until here.
        measured = x + noise[:, k]
        angle[:, k], torque[:, k] = measured, last
        speed = 0.8 * speed + 0.2 * (measured - before) * RATE
        before = measured
        following = 5 * (reference[:, k] - measured) - 0.05 * speed
        rate = (following - last) * RATE
        step = later if 2 * k == n else step
        if swing[0] and k % HELD == 0:
            system[1, 0] = -stiffness / inertia * (1 + swing[0] * np.sin(2 * np.pi * swing[1] * k / RATE))
            step = expm(system * period)
        x, v = (step[row, 0] * x + step[row, 1] * v + step[row, 2] * last + step[row, 3] * rate for row in (0, 1))
        last = following
    return angle, torque + own, reference
