"""What built-in terms are functions of, written down for the tests alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "offset": lambda _t, angle, _velocity: np.ones_like(angle),
    "coulomb": lambda _t, _angle, velocity: np.sign(velocity),
    "cubic": lambda _t, angle, _velocity: angle**3,
    "preload": lambda _t, angle, _velocity: np.sign(angle),
    "gravity": lambda _t, angle, _velocity: np.sin(angle),
    "viscous_asymmetric": lambda _t, _angle, velocity: np.abs(velocity),
    "quadratic_drag": lambda _t, _angle, velocity: velocity * np.abs(velocity),
}
