"""The torque that drives the rig."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_LOWEST, HIGHEST = 0.5, 12.0
"""Band of every excitation, Hz."""

_SPACING = 0.25
"""Distance of the multisine's frequencies, Hz: it repeats every 4 s."""

_AMPLITUDE = 0.05
"""Torque of each of the multisine's frequencies, N·m."""

_MOST_TABLES = 64
"""Offsets for which the torque is tabulated; a system so fast that it needs more steps a sample has little use of them."""

BLOCK = 20_000
"""Samples integrated at a time."""


class Drive:
    """The driving torque at any time."""

    def __init__(self, excitation: str, sample_rate: float, samples: int, generator: np.random.Generator) -> None:
        self._sample_rate = sample_rate
        self._period = 0
        self._frequencies, self._phases, self._amplitudes = np.zeros(0), np.zeros(0), np.zeros(0)
        count = round((HIGHEST - _LOWEST) / _SPACING) + 1
        if excitation == "multisine":
            self._frequencies = np.linspace(_LOWEST, HIGHEST, count)
            self._phases = generator.uniform(0, 2 * np.pi, count)
            self._amplitudes = np.full(count, _AMPLITUDE)
            period = sample_rate / _SPACING
            # A table of a period that is longer than the recording costs more than it saves.
            self._period = round(period) if period <= samples and period.is_integer() else 0
        elif excitation == "random":
            lines = 200
            self._frequencies = generator.uniform(_LOWEST, HIGHEST, lines)
            self._phases = generator.uniform(0, 2 * np.pi, lines)
            self._amplitudes = _AMPLITUDE * math.sqrt(count / lines) * generator.rayleigh(math.sqrt(0.5), lines)
        else:
            # As much power as the multisine.
            self._amplitudes = np.array([_AMPLITUDE * math.sqrt(count)])
        self._tables: dict[float, Array] = {}

    def __call__(self, first: int, count: int, offset: float) -> Array:
        """Return the torque at ``offset`` of a sample period after each of some samples."""
        if not self._period or (offset not in self._tables and len(self._tables) == _MOST_TABLES):
            return self._at((np.arange(first, first + count, dtype=np.float64) + offset) / self._sample_rate)
        if offset not in self._tables:
            self._tables[offset] = self._at((np.arange(self._period, dtype=np.float64) + offset) / self._sample_rate)
        return np.take(self._tables[offset], np.arange(first, first + count), mode="wrap")

    def at_samples(self, samples: int) -> Array:
        """Return the torque at the first samples."""
        parts = range(0, samples, BLOCK)
        return np.concatenate([self(first, min(BLOCK, samples - first), 0.0) for first in parts])

    def _at(self, t: Array) -> Array:
        if not self._frequencies.size:
            sweep = 10.0
            local = t % sweep
            swept = 2 * np.pi * (_LOWEST * local + (HIGHEST - _LOWEST) / (2 * sweep) * local**2)
            return np.asarray(self._amplitudes[0] * np.sin(swept))
        torque = np.zeros(t.shape)
        for frequency, phase, amplitude in zip(self._frequencies, self._phases, self._amplitudes, strict=True):
            np.add(torque, amplitude * np.sin(2 * np.pi * frequency * t + phase), out=torque)
        return torque
