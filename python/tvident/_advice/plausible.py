"""Asks about numbers that a wrong unit, a reversed sign or swapped channels would explain."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tvident._arguments import listed, marks_in, may_be_days, told_once
from tvident._results import Estimates, Words
from tvident._units import ROTARY, Axis

SWAPPED = "are the channels of angle and torque swapped?"
"""How a question begins."""

_ONE_TURN = 2 * math.pi
"""An angle in rad that moves by more, to both sides, may be in degrees."""

_TURNS = 1e-3
"""By how much a period of a turn or half of one in rad may be rounded."""

_SLOW = 0.09
"""A sample period in seconds from which on it may be in milliseconds: a step of 0.1 ms, at 10 kHz, looks like 0.1 s, and hardly a vibration
is sampled so slowly."""

_UNITS = ((1e-3, "milliseconds", "ms"), (1e-6, "microseconds", "us"), (1e-9, "nanoseconds", "ns"))
"""In which recorders write times, in seconds."""

_SLOWEST, _FASTEST = 20.0, 110e3
"""Rates in Hz between which a unit is possible: motion is hardly sampled more slowly, and vibration at up to 102.4 kHz."""

_CERTAIN = 4.0
"""Standard errors by which a number differs from zero: one of 16 000 does so by chance."""

_MOSTLY = 0.75
"""Of the samples, at which a parameter that changes has a sign."""

_TOLD, _IN_COMMON = 2.0, 0.7
"""Standard errors by which a stiffness that is there differs from zero: at most samples, and in the median of many windows."""


@dataclass(frozen=True)
class Plausible:
    """What is known of a call beside its numbers.

    Parameters
    ----------
    axis : Axis
        Units of the channels, and which of them nobody said.
    period : float
        Seconds from one sample to the next.
    names : sequence of str
        Unknowns.
    turn : float, optional
        Period of a wrapped angle, as it is used.
    """

    axis: Axis
    period: float
    names: Sequence[str]
    turn: float | None = None

    @np.errstate(all="ignore")
    def before(self, words: Words, angles: npt.NDArray[np.number], found: Estimates) -> Words:
        """Return words with questions before them, about units and the signs of every record, and behind them whether there is a spring."""
        records = np.asarray(angles).reshape(-1, angles.shape[-1])
        asked = [(*self._slow(), *self._far(one), *self._signs(found, place)) for place, one in enumerate(records)]
        if found.status.ndim == 1:
            is_said = any("stiffness=0" in line for line in words.advice)
            spring = [] if is_said else self._no_spring(found)
            return replace(words, advice=(*asked[0], *words.advice, *spring))
        lines = [f"record {place}: {line}" for place, each in enumerate(asked) for line in each]
        each = tuple(
            replace(one, advice=(*first, *one.advice)) for first, one in zip(asked, words.each, strict=bool(words.each))
        )
        return Words(words.reasons, (*lines, *words.advice), each)

    def _far(self, angle: npt.NDArray[np.number]) -> list[str]:
        if "angle" not in self.axis.assumed or self.axis.system is not ROTARY:
            return []
        if self.turn is not None and any(abs(self.turn - one) < _TURNS for one in (math.pi, _ONE_TURN)):
            return []  # whoever says that it wraps at a turn in rad knows its unit
        if marks_in(angle / self.axis.angle):
            return []  # which is asked for already
        is_finite = np.isfinite(angle)
        finite = angle if is_finite.all() else angle[is_finite]
        if not finite.size:
            return []
        least, most = float(finite.min()), float(finite.max())
        if most - least <= 2 * _ONE_TURN:
            return []
        reach = max(least, most, key=abs)
        turns = f"As rad it moves through {(most - least) / _ONE_TURN:.3g} turns"
        # An angle in degrees has fractions, unless it was rounded.
        is_whole = np.array_equal(finite, np.round(finite))
        what, more = (
            (", in whole numbers: counts of an encoder, or", " multiply counts by 2π over those of a turn;")
            if is_whole
            else (":", "")
        )
        return [
            f"the angle reaches {reach:.4g}{what} degrees? {turns};{more} if it is in degrees, give angle_unit='deg'"
        ]

    def _slow(self) -> list[str]:
        if "time" not in self.axis.assumed:
            return []
        if may_be_days(self.period):
            return [
                f"there is one sample in {self.period:.4g} s: is the time in days? Then give time_unit='days' with t= or delta="
            ]
        if self.period < _SLOW:
            return []
        rates = {(word, unit): 1 / (self.period * scale) for scale, word, unit in _UNITS}
        possible = [one for one, rate in rates.items() if _SLOWEST <= rate <= _FASTEST] or [
            # Slower than any, or faster: the unit that comes nearest.
            min(rates, key=lambda one: abs(math.log(rates[one] / _SLOWEST)))
        ]
        if len(possible) == 1:
            [(word, unit)] = possible
            question = f"{word}? Then give time_unit='{unit}' with t= or delta="
            if math.isclose(self.period, 1, rel_tol=1e-6):
                question += "; if it counts samples, give sample_rate= in its place"
        else:
            words = " or ".join(f"{one[0]} ({_in_words(rates[one])})" for one in possible)
            units = " or ".join(f"time_unit='{unit}'" for _, unit in possible)
            question = f"{words}? Then give {units} with t= or delta="
        return [f"there is one sample in {self.period:.4g} s: is the time in {question}"]

    def _signs(self, found: Estimates, record: int) -> list[str]:
        return asked_of_signs({name: self._sign(found, name, record) for name in ("inertia", "damping", "stiffness")})

    def _no_spring(self, found: Estimates) -> list[str]:
        """Return what to try where the stiffness of one record is not told from zero, and something else of its motion is told."""
        if "stiffness" not in self.names or not any(self._sign(found, name, 0) for name in ("inertia", "damping")):
            return []
        values, errors = (np.asarray(of["stiffness"]).reshape(-1) for of in (found.values, found.errors))
        errors = errors * np.asarray(found.factors.get("stiffness", 1.0)).reshape(-1)
        known = np.isfinite(values) & (errors > 0) & np.isfinite(errors)
        if not known.any():
            return []
        values, errors = values[known], errors[known]
        is_told = np.quantile(np.abs(values / errors), _MOSTLY) > _TOLD
        is_constant, near = np.ptp(values) == 0, abs(np.median(values)) < _IN_COMMON * np.median(errors)
        if is_told or not (is_constant or near):
            return []
        return [
            "the stiffness is not told from zero: if nothing pulls the machine back, give stiffness=0, and the others are known better"
        ]

    def _sign(self, found: Estimates, name: str, record: int) -> int:
        """Return 1 or -1 where the sign of an unknown is certain, 0 otherwise."""
        if name not in self.names:
            return 0
        count = found.status.shape[-1]
        values, errors = (
            told_once(np.broadcast_to(of[name], found.status.shape).reshape(-1, count)[record])
            for of in (found.values, found.errors)
        )
        if name in found.factors:
            errors = errors * np.asarray(found.factors[name]).reshape(-1)[record]
        return certain_sign(values, errors)


def certain_sign(values: npt.NDArray[np.float64], errors: npt.NDArray[np.float64]) -> int:
    """Return 1 or -1 where the sign of most values is certain, 0 otherwise."""
    known = np.isfinite(values) & np.isfinite(errors)
    if not known.any():
        return 0
    certain = known & (np.abs(values) > _CERTAIN * errors)
    for sign in (-1, 1):
        if np.count_nonzero(certain & (sign * values > 0)) >= _MOSTLY * np.count_nonzero(known):
            return sign
    return 0


def asked_of_signs(sign: Mapping[str, int]) -> list[str]:
    """Return what explains signs that no machine has, in words: of inertia, damping and stiffness, 0 where none is certain."""
    negative = [name for name, one in sign.items() if one < 0]
    if not negative:
        return []
    if sign["inertia"] < 0 < sign["stiffness"]:
        return [f"inertia is negative and stiffness positive: {SWAPPED}"]
    if sign["inertia"] < 0:
        words = listed(negative)
        question = f"{words} {'are' if len(negative) > 1 else 'is'} negative: is the torque's sign reversed, are the channels swapped?"
        return [f"{question} The torque is the one that acts on the system; if it is the reaction to it, pass -torque"]
    asked = []
    if sign["stiffness"] < 0 < sign["inertia"]:
        asked.append(
            "stiffness has the other sign than inertia: so it is about an unstable position, as of an inverted pendulum; else look "
            "for a missing term (gravity, offset) or for a controller's torque that was not recorded"
        )
    if sign["damping"] < 0:
        asked.append(
            "damping is negative: energy would be fed in. Is the torque late (lag='auto'), was one channel filtered, does a controller "
            "act (instrument=)?"
        )
    return asked


def _in_words(rate: float) -> str:
    """Return a sample rate with its unit."""
    return f"{rate / 1000:.3g} kHz" if rate >= 1000 else f"{rate:.3g} Hz"  # noqa: PLR2004 - kilo
