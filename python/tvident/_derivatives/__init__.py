"""Differentiates noisy samples: local polynomials of chosen order or window, and the Savitzky–Golay filter."""

from tvident._derivatives.fit import LocalPolynomialFit
from tvident._derivatives.incomplete import Incomplete, Part, check_weighted, filled, gaps_given, leaves_out
from tvident._derivatives.local_polynomials import fit_local_polynomials, rates_of_channel
from tvident._derivatives.plans import HIGHEST_ORDER, SHORTEST_WINDOW, plan, quantisation_step
from tvident._derivatives.savitzky_golay import savgol_filter

__all__ = [
    "HIGHEST_ORDER",
    "SHORTEST_WINDOW",
    "Incomplete",
    "LocalPolynomialFit",
    "Part",
    "check_weighted",
    "filled",
    "fit_local_polynomials",
    "gaps_given",
    "leaves_out",
    "plan",
    "quantisation_step",
    "rates_of_channel",
    "savgol_filter",
]
