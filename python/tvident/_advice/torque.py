"""What the torque itself tells, in words: a sensor that is not linear, a coupling that bends."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tvident import _core
from tvident._arguments import with_error
from tvident._status import Status

RESONANCE = "resonance"
"""What a torque has of its second derivative where something bends."""

_POWERS = {"torque_square": (2, "1/({})"), "torque_cube": (3, "1/({})^2")}
"""What it has of a power of its own where its sensor is not linear: the power, and the unit of its factor."""

OF_TORQUE = {RESONANCE, *_POWERS}

_MENDED_FIRST = {"held", "wrapped", "clipped"}
"""Defects of a channel that any power explains a part of."""


def told_by_torque(found: _core.Identification, suspects: Sequence[_core.Suspect], unit: str) -> list[str]:
    """Return what the torque tells of its sensor or of the machine, and what to do."""
    flags = Status(found.record_status)
    is_mended_first = any(defect.name in _MENDED_FIRST for defect in found.defects)
    # Powers of the torque explain a part of whatever narrow and wide test functions disagree about.
    powers = [] if is_mended_first or Status.SCALES_DISAGREE in flags else list(_POWERS)
    return [
        _resonance(one) if one.name == RESONANCE else _power(one, unit)
        for one in suspects
        if one.name in {RESONANCE, *powers}
    ]


def _resonance(one: _core.Suspect) -> str:
    frequency = 1 / (2 * math.pi * math.sqrt(abs(one.value)))
    error = frequency * one.stderr / abs(2 * one.value)
    how, where = ("larger", "the angle is measured behind it") if one.value > 0 else ("smaller", "a load is behind it")
    return (
        f"the faster the motion is, the {how} it is than that of one rigid mass, as where a coupling bends, which resonates near "
        f"{with_error(frequency, error)} Hz, and {where}: drive slower motion alone, whose frequencies' squares are small beside that "
        "of the resonance, or measure both on one side of the coupling"
    )


def _power(one: _core.Suspect, unit: str) -> str:
    power, per = _POWERS[one.name]
    return (
        f"the sensor of the torque seems not to be linear: it adds torque^{power} times {with_error(one.value, one.stderr)} "
        f"{per.format(unit)}, so parameters are wrong as its sensitivity is: calibrate it, or give torque - {one.value:.4g} * "
        f"torque**{power} as the torque, which is right if small torques are"
    )
