"""The methods that came before, with settings by hand: to compare with, not to identify with."""

from tvident._baselines import (
    MethodComparison,
    Tracked,
    chebyshev_derivatives,
    compare_methods,
    expanded_least_squares,
    lanczos_derivatives,
    random_walk_smoother,
    recursive_least_squares,
    savgol_derivatives,
    tvarx,
)

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
