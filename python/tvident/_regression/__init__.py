"""Solves least squares in every window of rows."""

from tvident._regression.rolling import RollingRegression, rolling_least_squares

__all__ = [
    "RollingRegression",
    "rolling_least_squares",
]
