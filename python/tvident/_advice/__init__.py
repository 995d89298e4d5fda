"""Says in words what was chosen and why, and what to do next."""

from tvident._advice.strong import ExplainedStrong
from tvident._advice.weak import Explained

__all__ = [
    "Explained",
    "ExplainedStrong",
]
