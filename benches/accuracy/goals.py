"""The figures that this library is to reach: errors of K / I / C in %, at a torque SNR of 20 dB."""

from __future__ import annotations

from accuracy.cases import Case, Pattern

Triple = tuple[float, float, float]

_LOW_NOISE = 1e-2
"""Up to this noise of the angle, and with an encoder of at least 1024 counts, the first figures hold."""
_FINE_ENCODER = 1024

_GOALS: dict[Pattern, tuple[Triple, Triple, Triple]] = {
    "slider": ((0.35, 0.10, 0.6), (0.45, 0.25, 0.6), (1.0, 0.7, 0.7)),
    "ramp": ((0.20, 0.10, 0.8), (0.25, 0.2, 0.8), (0.55, 0.5, 0.9)),
    "square": ((4.0, 0.15, 0.6), (5.0, 0.3, 0.6), (5.5, 0.8, 0.8)),
    "I and C vary": ((1.7, 1.7, 5.5), (2.1, 2.2, 12.0), (3.1, 3.3, 20.0)),
}


def goal(case: Case) -> Triple | None:
    """Return the figures for a case, where there are any."""
    figures = _GOALS.get(case.pattern)
    if figures is None:
        return None
    low, middle, high = figures
    if case.encoder_counts is not None:
        return low if case.encoder_counts >= _FINE_ENCODER else None
    return {3e-2: middle, 1e-1: high}.get(case.angle_noise, low if case.angle_noise <= _LOW_NOISE else None)
