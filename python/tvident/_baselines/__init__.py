"""Keeps the methods that came before, to compare with: derivatives over the whole record, recursive least squares, smoothers, TVARX."""

from tvident._baselines.comparison import MethodComparison, compare_methods
from tvident._baselines.derivatives import chebyshev_derivatives, lanczos_derivatives, savgol_derivatives
from tvident._baselines.discrete import tvarx
from tvident._baselines.recursive import Tracked, random_walk_smoother, recursive_least_squares
from tvident._baselines.sums import expanded_least_squares

__all__ = [
    "MethodComparison",
    "Tracked",
    "chebyshev_derivatives",
    "compare_methods",
    "expanded_least_squares",
    "lanczos_derivatives",
    "random_walk_smoother",
    "recursive_least_squares",
    "savgol_derivatives",
    "tvarx",
]
