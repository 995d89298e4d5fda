"""Units of parameters, terms and results."""

from __future__ import annotations

from tvident._choices import BUILT_IN

UNITS = {
    "time": "s",
    "angle": "rad",
    "torque": "N m",
    "inertia": "kg m^2",
    "damping": "N m s/rad",
    "stiffness": "N m/rad",
    "natural_frequency": "Hz",
    "damping_ratio": "1",
    "angle_zero": "rad",
    "condition": "1",
    "residual_std": "N m",
    "velocity_bias": "rad/s",
    "acceleration_bias": "rad/s^2",
}
UNITS |= {term.name: term.unit for term in BUILT_IN.values()}
UNITS |= {f"{term.name}.{name}": unit for term in BUILT_IN.values() for name, unit in term.inner.items()}
"""Units of results for an angle in rad and a torque in N m."""


LINEAR_UNITS = {
    name: unit.replace("kg m^2", "kg").replace("N m", "N").replace("rad", "m") for name, unit in UNITS.items()
}
"""The same for a position in m and a force in N."""
