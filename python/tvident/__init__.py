"""Identification of inertia, damping and stiffness that change while they are measured, and derivatives of noisy recordings."""

from tvident.derivatives import LocalPolynomialFit, fit_local_polynomials
from tvident.identification import identify
from tvident.regression import RollingRegression, rolling_least_squares
from tvident.result import Identification
from tvident.rig import Recording, simulate_torsional_rig
from tvident.savitzky_golay import savgol_filter
from tvident.status import Status
from tvident.terms import Term

__all__ = [
    "Identification",
    "LocalPolynomialFit",
    "Recording",
    "RollingRegression",
    "Status",
    "Term",
    "fit_local_polynomials",
    "identify",
    "rolling_least_squares",
    "savgol_filter",
    "simulate_torsional_rig",
]
