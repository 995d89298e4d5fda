"""Simulates recordings whose truth is known."""

from tvident._simulate.recording import Recording
from tvident._simulate.rig import simulate_torsional_rig

__all__ = [
    "Recording",
    "simulate_torsional_rig",
]
