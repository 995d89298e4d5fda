"""Units of parameters, terms and results."""

from __future__ import annotations

UNITS = {
    "time": "s",
    "inertia": "kg m^2",
    "damping": "N m s/rad",
    "stiffness": "N m/rad",
    "natural_frequency": "Hz",
    "damping_ratio": "1",
    "offset": "N m",
    "coulomb": "N m",
    "cubic": "N m/rad^3",
    "condition": "1",
    "residual_std": "N m",
}
"""Units of results for an angle in rad and a torque in N m."""
