"""Holds what an identification found, and what follows from it."""

from tvident._results.estimates import Estimates
from tvident._results.result import Identification
from tvident._results.words import Words

__all__ = ["Estimates", "Identification", "Words"]
