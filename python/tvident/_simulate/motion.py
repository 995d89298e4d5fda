"""The motion of the rig: its equation integrated by the Magnus expansion of fourth order."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._simulate.drive import BLOCK, HIGHEST, Drive

Array: TypeAlias = npt.NDArray[np.float64]

_ANGLE_A_STEP = 0.01
"""Phase that the highest frequency may advance in one step of integration: keeps the angle good to 1e-10."""

_MOST_AT_ONCE = 10_000
"""More belong to a system far too fast for its samples; each takes about 100 µs however few samples there are."""

_MOST_STEPS = 1_000_000_000
"""Steps of integration in all: about ten minutes."""


def integrate(
    samples: int, sample_rate: float, coefficients: Callable[[Array], tuple[Array, Array, Array]], drive: Drive
) -> tuple[Array, Array]:
    """Return angle and velocity at every sample, from rest."""
    probe = np.arange(0, samples, max(1, samples // 1000), dtype=np.float64) / sample_rate
    with np.errstate(over="ignore"):
        # What is too fast for a double is too fast to be followed.
        stiffness, damping, _ = coefficients(probe)
        fastest = max(2 * np.pi * HIGHEST, math.sqrt(float(np.max(stiffness))), float(np.max(damping)))
    steps = _steps(samples, fastest, sample_rate)
    h = 1 / (sample_rate * steps)
    angle, velocity = np.empty(samples), np.empty(samples)
    x, v = 0.0, 0.0
    for first in range(0, samples, BLOCK):
        count = min(BLOCK, samples - first)
        # The affine map of each sample period, composed of those of its steps.
        total: Any = (
            np.ones(count),
            np.zeros(count),
            np.zeros(count),
            np.ones(count),
            np.zeros(count),
            np.zeros(count),
        )
        for step in range(steps):
            nodes = [(step + 0.5 + sign * math.sqrt(3) / 6) / steps for sign in (-1, 1)]
            matrices = []
            for node in nodes:
                k, c, g = coefficients((np.arange(first, first + count, dtype=np.float64) + node) / sample_rate)
                matrices.append((k, c, g * drive(first, count, node)))
            total = _compose(_magnus(h, *matrices), total)
        angles, velocities = [], []
        for a, b, c, d, e, f in zip(*(part.tolist() for part in total), strict=True):
            angles.append(x)
            velocities.append(v)
            x, v = a * x + b * v + e, c * x + d * v + f
        angle[first : first + count], velocity[first : first + count] = angles, velocities
    return angle, velocity


def _steps(samples: int, fastest: float, sample_rate: float) -> int:
    """Return the steps of integration from one sample to the next, if the whole simulation ends in a few minutes."""
    steps = fastest / sample_rate / _ANGLE_A_STEP
    if steps > _MOST_AT_ONCE:
        most, got = _MOST_AT_ONCE * _ANGLE_A_STEP, steps * _ANGLE_A_STEP
        raise ValueError(
            f"the fastest motion must turn by at most {most:g} rad in a sample period; got {got:.3g} rad at {fastest / (2 * np.pi):.3g} Hz "
            f"and {sample_rate:g} samples a second; raise sample_rate, or change inertia, damping or torsional_rigidity"
        )
    steps = max(1, math.ceil(steps))
    if samples * steps > _MOST_STEPS:
        raise ValueError(
            f"a simulation must need at most {_MOST_STEPS:g} steps of integration; got {samples * steps:g} for a motion of "
            f"{fastest / (2 * np.pi):.3g} Hz; shorten the recording"
        )
    return steps


def _magnus(h: float, one: tuple[Array, Array, Array], other: tuple[Array, Array, Array]) -> Any:
    """Return the affine map of one step of x' = v, v' = -k x - c v + g, given (k, c, g) at its two Gauss points.

    The Magnus expansion of fourth order: the exponential of h (M1 + M2)/2 - h² √3/12 (M1 M2 - M2 M1).
    """
    (k1, c1, g1), (k2, c2, g2) = one, other
    s = math.sqrt(3) / 12 * h * h
    a = -s * (k1 - k2)
    b = h - s * (c1 - c2)
    e = -s * (g2 - g1)
    c = -h / 2 * (k1 + k2) - s * (c1 * k2 - c2 * k1)
    d = -h / 2 * (c1 + c2) - s * (k2 - k1)
    f = h / 2 * (g1 + g2) - s * (c2 * g1 - c1 * g2)
    # P = Σ B^n / (n+1)!, so that exp(B) = 1 + B P and the inhomogeneous part is P (e, f).
    terms = 10
    pa, pb, pc, pd = (
        np.full_like(a, 1 / (terms + 1)),
        np.zeros_like(a),
        np.zeros_like(a),
        np.full_like(a, 1 / (terms + 1)),
    )
    for n in range(terms, 0, -1):
        pa, pb, pc, pd = (
            (1 + (a * pa + b * pc)) / n,
            (a * pb + b * pd) / n,
            (c * pa + d * pc) / n,
            (1 + (c * pb + d * pd)) / n,
        )
    return (
        1 + a * pa + b * pc,
        a * pb + b * pd,
        c * pa + d * pc,
        1 + c * pb + d * pd,
        pa * e + pb * f,
        pc * e + pd * f,
    )


def _compose(later: Any, earlier: Any) -> Any:
    """Return the affine map that does one after another."""
    a2, b2, c2, d2, e2, f2 = later
    a1, b1, c1, d1, e1, f1 = earlier
    return (
        a2 * a1 + b2 * c1,
        a2 * b1 + b2 * d1,
        c2 * a1 + d2 * c1,
        c2 * b1 + d2 * d1,
        a2 * e1 + b2 * f1 + e2,
        c2 * e1 + d2 * f1 + f2,
    )
