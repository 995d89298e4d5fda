"""Holds what an identification found, and what follows from it."""

from tvident._results.result import Identification

__all__ = [
    "Identification",
]
