"""What to do about a channel that a recorder spoilt, in words."""

from __future__ import annotations

import math

from tvident._arguments import ordinal

_PERIODS = (2 * math.pi, math.pi, 360.0, 180.0, 1.0, *(2.0**bits for bits in range(8, 25)))
"""Periods of wrapped angles: a turn or half of one in rad, degrees and turns, and encoders' counts."""

_NEAR = 0.1
"""A wrapped angle jumps by its period less what it moves in one sample, which is at most this part of the period."""


def spoilt(defect: str, amount: float, *, alone: bool = True) -> str:
    """Return what was done to a channel, by what it is called and how much of it there is, and what to do; its name comes before.

    One mass alone can be given times of each channel, and a period.
    """
    if defect == "clipped":
        return (
            f"is clipped: {amount:.1%} of its samples lie at its largest or smallest value: make these NaN, or record with a "
            "larger range"
        )
    if defect == "left out":
        return (
            f"is clipped: {amount:.1%} of its samples lie at its largest or smallest value: they count as missing; record with a "
            "larger range"
        )
    if defect == "interpolated":
        channels = (
            "both channels, or give what was recorded with times of its own, t=(…, …)" if alone else "all channels"
        )
        return (
            f"lies on straight lines between every {ordinal(amount)} sample, which weakens its fast motion: keep every "
            f"{ordinal(amount)} sample of {channels}"
        )
    period = f"period={_period(amount):.8g}"
    cure = f"give {period}" if alone else f"pass it through numpy.unwrap with {period}"
    return f"jumps by {amount:.4g} rad: it is wrapped, {cure}, or the period that it has"


def held(amount: float, channels: str) -> str:
    """Return what to do about a channel that holds its values for so many samples, beside what other channels there are."""
    return (
        f"holds every value for {amount:.0f} samples, which makes it late by half of that: keep every {ordinal(amount)} sample of "
        f"{channels} channels"
    )


def _period(jump: float) -> float:
    """Return the period of an angle that jumps so far."""
    near = (one for one in _PERIODS if (1 - _NEAR) * one <= jump <= (1 + _NEAR / 2) * one)
    return min(near, key=lambda one: abs(one - jump), default=jump)
