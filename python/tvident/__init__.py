"""Identification of inertia, damping and stiffness that change while they are measured, and derivatives of noisy recordings."""

from tvident._compare import ModelComparison, compare_models
from tvident._derivatives import LocalPolynomialFit, fit_local_polynomials, savgol_filter
from tvident._equation import Term
from tvident._identify import StrongForm, WeakForm, identify
from tvident._regression import RollingRegression, rolling_least_squares
from tvident._results import Identification, Scan
from tvident._simulate import Recording, simulate_torsional_rig
from tvident._status import Status

__all__ = [
    "Identification",
    "LocalPolynomialFit",
    "ModelComparison",
    "Recording",
    "RollingRegression",
    "Scan",
    "Status",
    "StrongForm",
    "Term",
    "WeakForm",
    "compare_models",
    "fit_local_polynomials",
    "identify",
    "rolling_least_squares",
    "savgol_filter",
    "simulate_torsional_rig",
]
