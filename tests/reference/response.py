"""The response of an oscillator, by an integrator of its own: parameters constant and torque linear over a sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

Array = npt.NDArray[np.float64]


def response(
    coefficients: Sequence[Array],
    cubic: Array,
    gravity: Array,
    torque: Array,
    delta: float,
    initial: tuple[float, float],
) -> Array:
    """Give the angle at every sample."""
    columns = [*coefficients, cubic, gravity]
    state, angles = np.array(initial), [initial[0]]
    for sample in range(torque.size - 1):
        inertia, damping, stiffness, third, sine = (0.5 * (column[sample] + column[sample + 1]) for column in columns)
        begin, end = torque[sample], torque[sample + 1]

        def rates(
            t: float,
            y: Array,
            begin: float = begin,
            end: float = end,
            inertia: float = inertia,
            rest: tuple[float, ...] = (damping, stiffness, third, sine),
        ) -> list[float]:
            force = begin + (end - begin) * t / delta
            held = rest[0] * y[1] + rest[1] * y[0] + rest[2] * y[0] ** 3 + rest[3] * np.sin(y[0])
            return [y[1], (force - held) / inertia]

        state = solve_ivp(rates, (0.0, delta), state, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        angles.append(float(state[0]))
    return np.array(angles)
