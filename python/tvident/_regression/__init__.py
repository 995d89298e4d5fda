"""Solves least squares in every window of rows."""

from tvident._regression.rolling import MOST_REGRESSORS, RollingRegression, rolling_least_squares
from tvident._regression.windows import (
    Alignment,
    RegressionWindows,
    half_life_given,
    lags_given,
    least_given,
    unit_of_weights,
)

__all__ = [
    "MOST_REGRESSORS",
    "Alignment",
    "RegressionWindows",
    "RollingRegression",
    "half_life_given",
    "lags_given",
    "least_given",
    "rolling_least_squares",
    "unit_of_weights",
]
