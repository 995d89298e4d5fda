"""Signals that several tests work on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def signal(seed: int, n: int, noise: float = 0.01) -> Array:
    """Give four sines of 20 samples a cycle or more, with white noise."""
    generator = np.random.default_rng(seed)
    t = np.arange(n)
    frequencies = generator.uniform(0.001, 0.05, 4)
    waves = sum(np.sin(2 * np.pi * f * t + generator.uniform(0, 6)) for f in frequencies)
    return np.asarray(waves + noise * generator.standard_normal(n))
