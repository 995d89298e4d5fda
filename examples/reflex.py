"""A joint with two pathways: its own inertia, damping and stiffness, and a reflex that answers stretch late, slowly and in one direction.

Simulated first, where the truth is known. Where TVIDENT_DATA names a folder with the recording of an ankle, the same is asked of that.
"""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tvident

INERTIA, DAMPING, STIFFNESS, GAIN, DELAY, CORNER = 0.017, 0.6, 70.0, 8.0, 0.040, 18.0


Array = NDArray[np.float64]


def reflex(t: Array, angle: Array, velocity: Array, delay: float, corner: float) -> Array:
    """Return the stretch velocity, half-wave rectified, late by a delay and passed through a muscle: two poles at a corner in rad/s."""
    del angle
    stretch = np.maximum(np.interp(t - delay, t, velocity), 0.0)
    period = (t[-1] - t[0]) / (t.size - 1)
    times = np.arange(0.0, 12 / corner, period)
    return np.convolve(stretch, period * corner**2 * times * np.exp(-corner * times))[: t.size]


def identified(angle: Array, torque: Array, lag: float = 0.0) -> tvident.Identification:
    """Identify both pathways; the delay and the corner are searched."""
    pathway = tvident.Term("reflex", reflex, search={"delay": (0.02, 0.08), "corner": (8.0, 60.0)})
    return tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        inertia="constant",
        damping="constant",
        stiffness="constant",
        terms=[pathway, "offset"],
        lag=lag,
    )


t = np.arange(10_000) / 1000
angle, velocity, acceleration = np.zeros(t.size), np.zeros(t.size), np.zeros(t.size)
for amplitude, frequency, phase in ((0.02, 0.7, 0.0), (0.015, 2.3, 1.0), (0.008, 5.1, 2.0), (0.004, 11.3, 3.0)):
    omega = 2 * np.pi * frequency
    angle += amplitude * np.sin(omega * t + phase)
    velocity += amplitude * omega * np.cos(omega * t + phase)
    acceleration -= amplitude * omega**2 * np.sin(omega * t + phase)
torque = (
    INERTIA * acceleration + DAMPING * velocity + STIFFNESS * angle + GAIN * reflex(t, angle, velocity, DELAY, CORNER)
)
generator = np.random.default_rng(1)
result = identified(angle + 1e-5 * generator.standard_normal(t.size), torque + 0.05 * generator.standard_normal(t.size))
truth = {"inertia": INERTIA, "damping": DAMPING, "stiffness": STIFFNESS, "reflex": GAIN}
truth |= {"reflex.delay": DELAY, "reflex.corner": CORNER}
for name, true in truth.items():
    value, error = result.constants[name]
    print(f"{name:14} {value:.4f} ± {error:.4f}   (truth {true})")

recording = Path(os.environ.get("TVIDENT_DATA", "")) / "ankle_stationary.mat"
if recording.exists():
    channels = tvident.recordings.read(recording)
    # The torque has the other sign here, and is late by a millisecond. The summary says what these two pathways leave open.
    angle, torque = channels["angle"][:20_000], -channels["torque"][:20_000]
    print("\nthe ankle:")
    print(identified(angle, torque, lag=1e-3).summary())
