"""Compares candidates for the equation of motion: criterion, weights, parameters averaged over models."""

from tvident._compare.call import compare_models
from tvident._compare.comparison import ModelComparison

__all__ = ["ModelComparison", "compare_models"]
