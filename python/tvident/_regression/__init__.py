"""Solves least squares in every window of rows."""

from tvident._regression.rolling import MOST_REGRESSORS, RollingRegression, rolling_least_squares

__all__ = [
    "MOST_REGRESSORS",
    "RollingRegression",
    "rolling_least_squares",
]
