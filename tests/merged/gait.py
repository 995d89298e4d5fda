"""A joint over cycles of gait, as in a published simulation, and how well it is identified: ``python -m merged.gait`` prints a table.

Cavallo, Schouten, Lataire: Locally periodic kernel-based regression to identify time-varying ankle impedance during locomotion: a
simulation study. Known of it: ten cycles of 1.4 s, noise of the output at 15 dB, one condition whose impedance is periodic and one where
its amplitude and shape vary slightly over the cycles, normalised errors of the parameters of 1.33 to 4.06 %. Assumed here: the output is
the torque, its noise is white at 1 kHz; the profiles and how much they vary; a perturbation of 0.02 rad rms from 0.5 to 20 Hz; errors are
divided by the mean of a parameter, which is less than its range for damping and stiffness.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

import tvident

Array = npt.NDArray[np.float64]

CYCLES, SECONDS, SIGNAL_TO_NOISE = 10, 1.4, 15.0
HIGHEST = 20.0
"""Hz, of the perturbation."""
PERTURBATION = 0.02
"""rad, rms."""
PUBLISHED = (1.33, 4.06)
"""Per cent: the least and the largest error of a parameter."""
NAMES = ("inertia", "damping", "stiffness")
OVERLAP = 0.2
"""Of a cycle that a trial goes on before it begins and after it ends, so that windows reach over the ends."""


@dataclass(frozen=True)
class Gait:
    """Channels, and the truth. The phase counts cycles."""

    phase: Array
    angle: Array
    torque: Array
    truth: dict[str, Array]

    @property
    def time(self) -> Array:
        """Seconds."""
        return self.phase * SECONDS

    @property
    def sample_rate(self) -> float:
        """Hz."""
        return float((self.phase.size - 1) / (self.time[-1] - self.time[0]))

    def error(self, found: Any) -> dict[str, float]:
        """Give the root mean square error of every parameter in per cent of its mean."""
        return {
            name: float(100 * np.sqrt(np.mean((found[name] - true) ** 2)) / true.mean())
            for name, true in self.truth.items()
        }


def _bump(phase: Array, middle: float, width: float) -> Array:
    return np.asarray(np.exp((np.cos(2 * np.pi * (phase - middle)) - 1) / (2 * np.pi * width) ** 2))


def simulated(seed: int, *, variation: float = 0.0, rate: float = 1000.0) -> Gait:
    """Give a recording; the amplitude of profiles varies by so much (rms), their phase by a fifth of it, slowly over the cycles."""
    rng = np.random.default_rng(seed)
    samples = round(CYCLES * SECONDS * rate)
    phase = np.arange(samples) / rate / SECONDS

    def slow() -> Array:
        # In four to twenty cycles.
        per_cycle = rng.uniform(0.05, 0.25, 3)
        angles = 2 * np.pi * np.outer(phase, per_cycle) + rng.uniform(0, 2 * np.pi, per_cycle.size)
        return np.asarray(np.sin(angles).sum(axis=1) / np.sqrt(per_cycle.size / 2))

    amplitude, place = 1 + variation * slow(), phase + variation / 5 * slow()
    stiffness = 20 + amplitude * (130 * _bump(place, 0.42, 0.1) + 30 * _bump(place, 0.1, 0.06))
    damping = 0.6 + 0.9 * amplitude * _bump(place, 0.45, 0.12)
    inertia = np.full(samples, 0.015)
    omega = 2 * np.pi * np.arange(round(0.5 * CYCLES * SECONDS), round(HIGHEST * CYCLES * SECONDS)) / (CYCLES * SECONDS)
    size = 1 / np.hypot(1, omega / (2 * np.pi * 5))
    size *= PERTURBATION / np.sqrt(np.sum(size**2) / 2)
    argument = np.outer(phase * SECONDS, omega) + rng.uniform(0, 2 * np.pi, omega.size)
    angle, velocity = np.sin(argument) @ size, np.cos(argument) @ (size * omega)
    torque = inertia * -(np.sin(argument) @ (size * omega**2)) + damping * velocity + stiffness * angle
    noise = torque.std() * 10 ** (-SIGNAL_TO_NOISE / 20) * rng.standard_normal(samples)
    return Gait(phase, angle, torque + noise, {"inertia": inertia, "damping": damping, "stiffness": stiffness})


def cycles(gait: Gait) -> tuple[list[Array], list[Array], list[Array]]:
    """Cut a recording into a trial a cycle: angles, torques and phases."""
    at = [np.flatnonzero((gait.phase > one - OVERLAP) & (gait.phase < one + 1 + OVERLAP)) for one in range(CYCLES)]
    return (
        [gait.angle[place] for place in at],
        [gait.torque[place] for place in at],
        [gait.phase[place] - one for one, place in enumerate(at)],
    )


def aligned(gait: Gait) -> dict[str, Array]:
    """Identify with trials that are aligned on their phase; parameters at every sample."""
    identify: Any = tvident.identify
    angles, torques, phases = cycles(gait)
    result = identify(angles, torques, phase=phases, sample_rate=gait.sample_rate, ensemble_axis=0, terms=[])
    grid = np.append(result.phase, 1.0)
    found = {name: np.broadcast_to(getattr(result, name), result.phase.shape) for name in NAMES}
    return {name: np.interp(gait.phase % 1, grid, np.append(one, one[0])) for name, one in found.items()}


def _expanded(gait: Gait, **kinds: Any) -> dict[str, Array]:
    identify: Any = tvident.identify
    result = identify(gait.angle, gait.torque, sample_rate=gait.sample_rate, inertia="constant", terms=[], **kinds)
    return {name: np.broadcast_to(getattr(result, name), gait.phase.shape) for name in NAMES}


def harmonics(gait: Gait, size: int | Literal["auto"] = "auto") -> dict[str, Array]:
    """Identify harmonics of the phase, as many as the criterion says."""
    of_phase = tvident.Expansion("fourier", size=size, of=gait.phase % 1, limits=(0, 1))
    return _expanded(gait, damping=of_phase, stiffness=of_phase)


def locally_periodic(phase: Array, size: int) -> Array:
    """Give functions of a phase that counts cycles: harmonics, and beside each those that are slower or faster by a little.

    Distances are parts of a period half as long again as the record, which need not end as it begins. Those of low harmonics and small
    distances come first.
    """
    pairs = [(harmonic, aside) for harmonic in range(12) for aside in range(-6, 7) if harmonic > 0 or aside > 0]
    pairs.sort(key=lambda pair: pair[0] + 1.5 * abs(pair[1]))
    angles = 2 * np.pi * np.outer(phase, [harmonic + aside / (1.5 * CYCLES) for harmonic, aside in pairs[: size // 2]])
    both = np.stack([np.cos(angles), np.sin(angles)], axis=2).reshape(phase.size, -1)
    return np.concatenate([np.ones((phase.size, 1)), both], axis=1)


def broad_harmonics(gait: Gait, size: int | Literal["auto"] = 61) -> dict[str, Array]:
    """Identify harmonics of the phase that need not repeat themselves: locally periodic."""
    of_phase = tvident.Expansion(locally_periodic, size=size, of=gait.phase, limits=(0, CYCLES), largest=97)
    return _expanded(gait, damping=of_phase, stiffness=of_phase)


def windows(gait: Gait) -> dict[str, Array]:
    """Identify windows of time, which know nothing of cycles."""
    return _expanded(gait, damping="windowed", stiffness="windowed")


METHODS: dict[str, Callable[[Gait], dict[str, Array]]] = {
    "`phase=`: cycles as trials": aligned,
    "harmonics of the phase": harmonics,
    "harmonics, locally periodic": broad_harmonics,
    "windows of time": windows,
}


def medians(method: Callable[[Gait], dict[str, Array]], variation: float, seeds: int, rate: float) -> dict[str, float]:
    """Give medians of the errors over seeds."""
    each = []
    for seed in range(seeds):
        gait = simulated(seed, variation=variation, rate=rate)
        each.append(gait.error(method(gait)))
    return {name: float(np.median([one[name] for one in each])) for name in NAMES}


def main(seeds: int) -> None:
    print("| cycles | method | I % | C % | K % |\n|-|-|-|-|-|", flush=True)  # noqa: T201 - what it is for
    for words, variation, rate in (
        ("alike", 0.0, 1000.0),
        ("vary by 2.5 %", 0.025, 1000.0),
        ("vary by 5 %", 0.05, 1000.0),
        ("alike, 250 Hz", 0.0, 250.0),
        ("vary by 2.5 %, 250 Hz", 0.025, 250.0),
    ):
        for name, method in METHODS.items():
            found = medians(method, variation, seeds, rate)
            print(f"| {words} | {name} | " + " | ".join(f"{one:.2g}" for one in found.values()) + " |", flush=True)  # noqa: T201


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
