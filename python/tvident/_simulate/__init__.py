"""Simulates recordings whose truth is known."""

from tvident._simulate.recording import Recording
from tvident._simulate.rig import Excitation, Pattern, simulate_torsional_rig

__all__ = [
    "Excitation",
    "Pattern",
    "Recording",
    "simulate_torsional_rig",
]
