"""What is measured on: a recording of an oscillator whose stiffness changes, as long as wanted, the same every time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

RATE = 1000.0
"""Samples per second."""
_NOISE = 1e-3
"""Noise of the angle over its amplitude."""
_SINES = ((0.7, 0.3), (1.9, 0.25), (3.1, 0.2), (5.3, 0.1), (7.9, 0.1), (11.7, 0.05))
"""Frequency in Hz and amplitude."""


def recording(samples: int) -> tuple[Array, Array]:
    """Return an angle and the torque that drives it, both with noise."""
    generator = np.random.default_rng(20)
    t = np.arange(samples) / RATE
    angle, velocity, acceleration = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    for frequency, amplitude in _SINES:
        omega, phase = 2 * np.pi * frequency, generator.uniform(0, 2 * np.pi)
        sine, cosine = amplitude * np.sin(omega * t + phase), amplitude * np.cos(omega * t + phase)
        angle += sine
        velocity += omega * cosine
        acceleration -= omega**2 * sine
    torque = 0.0123 * acceleration + 0.1 * velocity + (15 + 3 * np.sin(0.5 * t)) * angle
    angle += _NOISE * generator.standard_normal(samples)
    torque += 0.1 * generator.standard_normal(samples)
    return angle, torque


def regression(samples: int, count: int = 3) -> tuple[Array, Array]:
    """Return some regressors as columns, and what they explain but for noise."""
    generator = np.random.default_rng(21)
    regressors = generator.standard_normal((samples, count))
    return regressors, regressors @ np.arange(1.0, count + 1) + 0.1 * generator.standard_normal(samples)
