"""Random calls of the simulator."""

from __future__ import annotations

from typing import Any

import numpy as np

import tvident
from hostile import arguments, invariants

FUNCTIONS: tuple[Any, ...] = (
    lambda t: t * np.nan,
    lambda _: 0.4,
    lambda _: np.zeros(3),
    lambda t: t * 0,
    lambda t: -1.0 - t,
    lambda t: 0.4 + 0.1 * np.tanh(t),
    lambda t: np.ma.masked_array(0.4 + 0 * t, mask=t > 0.1),
    lambda t: 0.4 + 0j * t,
    lambda _: None,
    5,
)


def simulated(generator: np.random.Generator) -> None:
    """Simulate: finite numbers, the same every time."""
    options = {"duration": arguments.one(generator, 0.001, 0.5, 1e-9, 1.5)} | arguments.some(
        generator,
        {
            "sample_rate": lambda: arguments.one(generator, 100.0, 1000.0, 333.3),
            "seed": lambda: arguments.one(generator, 5),
            "pattern": lambda: arguments.one(generator, "slider", "ramp", "square", "constant", *FUNCTIONS),
            "excitation": lambda: arguments.one(generator, "multisine", "chirp", "random"),
            "torque_snr_db": lambda: arguments.one(generator, 20.0),
            "angle_noise": lambda: arguments.one(generator, 1e-4),
            "encoder_counts": lambda: arguments.one(generator, 4096),
            "inertia": lambda: arguments.one(generator, 0.01, *FUNCTIONS),
            "damping": lambda: arguments.one(generator, 0.05, *FUNCTIONS),
            "torsional_rigidity": lambda: arguments.one(generator, 6.0),
        },
    )
    if _is_long(options["duration"], options.get("sample_rate", 1000.0)):
        return
    rig = tvident.simulate_torsional_rig(**options)
    numbers = {name: value for name, value in vars(rig).items() if isinstance(value, np.ndarray)}
    for name, value in numbers.items():
        assert np.isfinite(value).all(), f"{name} is not finite"
    again = vars(tvident.simulate_torsional_rig(**options))
    assert invariants.same(numbers, {name: again[name] for name in numbers}), "the same seed gives other numbers"


def _is_long(duration: Any, sample_rate: Any) -> bool:
    """Return whether a simulation may be meant, and takes minutes."""
    numbers = [one for one in (duration, sample_rate) if isinstance(one, int | float) and abs(one) < 2**1000]
    return len(numbers) == 2 and 1e5 < numbers[0] * numbers[1] <= 1e8
