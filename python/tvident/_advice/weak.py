"""Reasons and advice of the weak form, in words."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tvident import _core
from tvident._advice.channels import spoilt
from tvident._advice.collinear import collinear
from tvident._advice.events import (
    comes_late,
    jumps_beside_pulses,
    lost_samples,
    pulses,
    spikes,
    unexplained_here,
    unread,
    untold_here,
)
from tvident._advice.instrument import fed_back
from tvident._advice.lag import untold_lag
from tvident._advice.scales import disagreement, scales_compared
from tvident._advice.torque import OF_TORQUE, told_by_torque
from tvident._advice.undescribed import drives, driving
from tvident._arguments import listed
from tvident._equation import BUILT_IN, COEFFICIENTS, OFFSET, UNITS
from tvident._results import NOT_CONSTANT, UNFOLLOWED, Words
from tvident._status import Status

_SHOWN = 6
"""Jumps that are listed at most."""

_BEYOND_CHANCE = 4.0
"""A parameter jumps where it differs by more than so many standard errors of the difference: one of 16 000 does so by chance."""

_COUNTED = 1e6
"""From so many times the noise on it is none that counts: the record is free of noise, or nearly."""

FREE_OFFSET = "an offset that is free in every window predicts better"

_BESIDE = " beside the lag that is given"
_BEGIN = "begin with the first of these: the others may then disappear"


@dataclass(frozen=True)
class Explained:
    """One record as it was identified in weak form.

    Parameters
    ----------
    found : _core.Identification
        What the core returned.
    names : sequence of str
        What the core's unknowns are called.
    chosen : collection of str
        Settings that were chosen from the record.
    tested : collection of str
        Unknowns that the record was to decide upon.
    period, step : float, int
        Seconds from one sample to the next; samples from one number to the next.
    coherence : float, optional
        Of the noise of both channels, above the motion.
    lag : float, optional
        Samples by which the torque was taken to be late.
    gains : sequence of str
        That the gain of a channel seems to change, in words.
    units : mapping of str to str, optional
        Of parameters and terms.
    source : {"angle", "velocity", "acceleration"}
        The channel of the motion whose noise is known.
    """

    found: _core.Identification
    names: Sequence[str]
    chosen: Collection[str]
    tested: Collection[str]
    period: float
    step: int
    coherence: float | None = None
    lag: float = 0.0
    gains: Sequence[str] = ()
    units: Mapping[str, str] = field(default_factory=lambda: UNITS)
    source: str = "angle"

    def words(self) -> Words:
        """Return what there is to say."""
        flags = Status(self.found.record_status)
        if self.found.unexplained and Status.RANK_DEFICIENT in flags:
            return Words((self._noise(),), (*self._defects(), self._unexplained()))
        if Status.RANK_DEFICIENT in flags:
            undetermined = (
                f"the record does not determine {listed(list(self.names))}: nothing moves, or a single frequency does not separate "
                "inertia from stiffness: check that angle and torque are the right channels, excite two or more frequencies, leave a "
                "term out, or give what is known"
            )
            return Words((self._noise(),), (*self._defects(), undetermined))
        reasons = (
            self._noise(),
            self._test_function(),
            *scales_compared(self.found, flags),
            *lost_samples(self.found),
            *spikes(self.found),
            *unread(self.found),
            *self._rest(),
            *self._lag(),
            *self._angle_zero(),
            *self._windows(),
            *self._weights(),
            *self._kinds(),
            *pulses(self.found, self.period),
            *self._jumps(),
        )
        if any(defect.name == "wrapped" for defect in self.found.defects):
            # A jump of a turn leaves nothing of the rest: what else looks wrong is its consequence.
            return Words(reasons, tuple(self._defects()))
        advice = (
            *fed_back(self.coherence),
            *(() if self.lag or "lag" in self.chosen else untold_lag(self.found, self.names, self.period)),
            *disagreement(self.found, self.names, self.units, flags),
            *self._misfit(flags),
            *unexplained_here(self.found, self.period, self.step),
            *untold_here(self.found, self._windowed(), self.period, self.step),
            *self.gains,
            *self._outside(),
            *self._contradictions(),
            *self._free_offset(),
            *self._chance(),
            *self._limits(flags),
        )
        # Where unknowns are collinear the rest may follow from it. Else what can be typed comes before what is to be looked for.
        return Words(
            reasons,
            (
                *self._defects(),
                *collinear(self.found, self.names),
                *self._of_torque(),
                *self.suspicions(),
                *driving(self._conspicuous(), self.units),
                *advice,
            ),
        )

    def _constants(self) -> list[tuple[str, _core.Unknown]]:
        """Return the constants by name."""
        return [
            (name, one) for name, one in zip(self.names, self.found.unknowns, strict=True) if one.kind == "constant"
        ]

    def _changing(self) -> list[str]:
        """Return the names of the unknowns that are not constant."""
        return [name for name, one in zip(self.names, self.found.unknowns, strict=True) if one.kind != "constant"]

    def _windowed(self) -> list[str]:
        """Return the names of the unknowns that belong to windows."""
        return [name for name, one in zip(self.names, self.found.unknowns, strict=True) if one.kind == "windowed"]

    def _noise(self) -> str:
        noise = self.found.noise
        angle, torque = (np.nan, np.nan) if noise is None else np.sqrt((noise.angle, noise.torque))
        of_angle, of_torque = ("rad", "N m") if self.units["stiffness"] == UNITS["stiffness"] else ("m", "N")
        of_angle += {"angle": "", "velocity": "/s", "acceleration": "/s^2"}[self.source]
        return f"noise, assumed to be white: {angle:.2g} {of_angle} in the {self.source}, {torque:.2g} {of_torque} in the torque"

    def _unexplained(self) -> str:
        return (
            f"the motion explains no more of the torque than chance does, so the record does not determine {listed(list(self.names))}: the "
            "torque is noise, as in a free decay, the angle is noise, or the channels do not belong together; record a torque that exceeds "
            "its noise, or, if no torque acts, give a torque of zeros and one parameter, such as inertia=1: the others follow in its unit, "
            "natural frequency and damping ratio whatever its value"
        )

    def _test_function(self) -> str:
        words = f"test function of {self.found.window_length} samples, exponent {self.found.exponent}"
        if not {"window_length", "exponent"} & set(self.chosen):
            return f"{words}: as given"
        if self.found.scan is not None and self.found.scan.moved:
            return f"{words}: the one that the spectra suggest finds other parameters, or leaves what the noise does not explain"
        return f"{words}: smallest expected errors, given the angle's spectrum and this noise"

    def _rest(self) -> list[str]:
        if not self.found.resting:
            return []
        words = (
            f"the machine rests in {self.found.resting:.0%} of the record: friction is unknown there, so equations with such "
            "samples do not count"
        )
        return [words]

    def _defects(self) -> list[str]:
        words = []
        for one in self.found.defects:
            defect, amount = one.name, one.amount
            if defect == "broken":
                continue
            name = ("angle", "torque", "velocity", "acceleration")[one.channel]
            if defect in {"held", "filtered"}:
                cure = comes_late(
                    self.found, (name, defect, amount), self.period, late=bool(self.lag or self.found.lag)
                )
            else:
                cure = spoilt(defect, amount)
            words.append(f"the {name} {cure}")
        return words

    def _lag(self) -> list[str]:
        if "lag" not in self.chosen:
            return []
        if self.found.lag is None:
            held = f", and errors hold one of {self.found.untold_lag:.1g} samples" if self.found.untold_lag else ""
            return [
                f"the record does not separate a lag of the torque from damping: lag 0 is used{held}; excite more frequencies, or give lag="
            ]
        lag = self.found.lag
        return [
            f"the torque is delayed by {lag.value:.3f} ± {lag.stderr:.1g} samples: with this lag its rate explains nothing more"
        ]

    def _angle_zero(self) -> list[str]:
        if self.found.angle_zero is None:
            return []
        zero = self.found.angle_zero
        words = (
            f"the spring is relaxed at {zero.value:.4g} ± {zero.stderr:.1g} {self.units['angle_zero']} of the encoder: its torque is "
            "stiffness times (angle - this), since a constant offset alone is contradicted, and rows are predicted better so"
        )
        return [words]

    def _jumps(self) -> list[str]:
        jumps = jumps_beside_pulses(self.found)
        if not jumps:
            return []
        shown = ", ".join(f"{jump * self.period:.6g}" for jump in jumps[:_SHOWN]) + (
            " …" if len(jumps) > _SHOWN else ""
        )
        many = f"{len(jumps)} times, at" if len(jumps) > 1 else "at"
        jumping = [name for name in self._changing() if any(self._is_other_after(name, jump) for jump in jumps)]
        which = f"values of {listed(jumping)}" if jumping else "windowed parameters"
        return [f"{which} jump {many} {shown} s: windows end there"]

    def _is_other_after(self, name: str, jump: int) -> bool:
        """Return whether a parameter differs by more than its errors between a test function before a jump and one after it."""
        unknown = self.found.unknowns[list(self.names).index(name)]
        last = unknown.values.size - 1
        sides = [min(max(sample // self.step, 0), last) for sample in (jump - self._reach(), jump + self._reach())]
        before, after = unknown.values[sides]
        return bool(abs(after - before) > _BEYOND_CHANCE * unknown.factor * math.hypot(*unknown.stderr[sides]))

    def _reach(self) -> int:
        return self.found.window_length // 2

    def _outside(self) -> list[str]:
        if self.found.outside_mask is None:
            return []
        outside = self.found.outside_mask
        parts = [
            f"{self.names[one.unknown]} {one.value:.4g} ± {one.stderr:.1g} instead of {self.found.unknowns[one.unknown].values[0]:.4g}"
            for one in outside.differing
        ]
        left = outside.residual_ratio
        if left is not None and left > _core.NOISE_MODEL_FAILS:
            parts.append(f"mean squared residual {left:.1f} times that inside")
        return [f"outside the mask the model fails: {', '.join(parts)}"]

    def _windows(self) -> list[str]:
        if not self.found.lengths:
            return []
        words, error = f"windows of {self.found.regression_window} samples", self.found.prediction_error
        left = f"cross-validation error {_times_noise(error)} (1 is the best possible)"
        why = "best of all lengths" if "regression_window" in self.chosen else "as given"
        return [
            f"{words}: {why}; {left}",
            "longer, shorter and one-sided windows are averaged with these where they predict better",
        ]

    def _weights(self) -> list[str]:
        weighted = (
            "all unknowns are constant, so equations are weighted by the inverse of the covariance of their noise "
            "(generalised least squares)"
        )
        return [weighted] if self.found.weighted else []

    def _kinds(self) -> list[str]:
        tests = {name: one.test for name, one in self._constants() if one.test is not None}
        agreeing = {name: test.probability for name, test in tests.items() if test.probability >= _core.NO_CHANCE}
        words = []
        if agreeing:
            chances = ", ".join(f"{probability:.2g}" for probability in agreeing.values())
            words.append(
                f"{listed(list(agreeing))} constant: noise explains the differences between eight parts of the record (p = {chances})"
            )
        alike = [name for name, test in tests.items() if name not in agreeing and self._hardly_differs(name, test)]
        if alike:
            words.append(
                f"{listed(alike)} constant: parts of the record differ by less than {_core.HARDLY_DIFFERS:.0%}"
            )
        untested = [name for name, one in self._constants() if one.test is None]
        if untested:
            pronoun = "it" if len(untested) == 1 else "them"
            words.append(
                f"{listed(untested)} constant: not tested, since single parts of the record do not determine {pronoun}"
            )
        freed = [name for name in self._changing() if name in self.tested and name != "stiffness"]
        if OFFSET in freed and "stiffness" in self._changing():
            freed.remove(OFFSET)
            words.append("offset in windows: one that is free in every window predicts better than a constant one")
        if self.found.pooling is None and freed:
            words.append(
                f"{listed(freed)} in windows: parts of the record differ by more than noise, and everything else is constant"
            )
        if self.found.pooling is not None:
            varying = [name for name, one in zip(self.names, self.found.unknowns, strict=True) if one.kind == "varying"]
            slow = varying or [name for name in ("inertia", "damping") if name in self._changing()]
            tested = set(slow) <= set(self.tested)
            why = "parts of the record differ by more than noise" if tested else "given as changing"
            over = f"local quadratics in time over {self.found.pooling * self.period:.3g} s"
            words.append(f"{listed(slow)} varying: {why}; {over}, the bandwidth that predicts best")
        return words

    def _misfit(self, flags: Status) -> list[str]:
        words = []
        if Status.NOISE_MODEL in flags:
            words.append(
                f"the cross-validation error is {_times_noise(self.found.prediction_error)}: is a term missing, "
                "is the torque delayed, or is the noise not white because a channel was filtered or drifts? Standard errors are "
                "estimated from the residuals instead, and may be too small"
            )
        if Status.COLOURED in flags:
            words.append(
                "the residuals are correlated over more than a test function: look for a drift, a disturbance or a sudden change; errors "
                "near it are larger than stated"
            )
        return words

    @property
    def suspects(self) -> list[Any]:
        """What seems to be missing, the surest first; friction that drives the motion is no friction."""
        found = [one for one in self._conspicuous() if one.name not in OF_TORQUE]
        return [one for one in found if not drives(one)]

    def _conspicuous(self) -> list[Any]:
        """Return what is beyond chance, the surest first."""
        return sorted(
            (one for one in self.found.suspects if one.conspicuous),
            key=lambda suspect: -abs(suspect.value) / suspect.stderr if suspect.stderr > 0 else -math.inf,
        )

    def _of_torque(self) -> list[str]:
        """Return what the torque tells of its sensor and of the machine, in words."""
        return told_by_torque(self.found, self._conspicuous(), self.units[OFFSET])

    def suspicions(self, names: Collection[str] | None = None) -> list[str]:
        """Return what seems to be missing, in words: everything, or some of it by name."""
        words = []
        for one in self.suspects:
            if names is not None and one.name not in names:
                continue
            if one.name == "lag":
                amount = f"{abs(one.value):.3g} ± {one.stderr:.1g}"
                words.append(
                    f"the torque seems to be {'delayed' if one.value > 0 else 'early'} by {amount} samples{_BESIDE * bool(self.lag)}: give "
                    f"lag={(self.lag + one.value) * self.period:.4g} (seconds), or align the channels"
                )
            else:
                term = BUILT_IN[one.name]
                # Inner parameters come after their terms, and are none.
                names = [name for name in self.names if name not in COEFFICIENTS]
                inner = {name for name in names if any(name.startswith(f"{other}.") for other in names)}
                terms = [name for name in names if name not in inner] + [one.name]
                amount = f"{one.value:.3g} ± {one.stderr:.1g} {self.units[term.name]}"
                words.append(f"{term.suspected(one.value, amount)}: give terms={terms}")
        if len(words) > 1:
            words.append(_BEGIN)
        return words

    def _hardly_differs(self, name: str, test: Any) -> bool:
        """Return whether a parameter that was to vary if it does differs by too little between parts of the record to contradict it."""
        return name in COEFFICIENTS and name in self.tested and test.spread < _core.HARDLY_DIFFERS

    def _contradictions(self) -> list[str]:
        words = []
        for name, one in self._constants():
            if one.test is None or one.test.probability >= _core.NO_CHANCE or self._hardly_differs(name, one.test):
                continue
            if name in COEFFICIENTS and name in self.tested:
                words.append(
                    f"{name}{UNFOLLOWED} ({one.test.spread:.0%}): is a friction missing, is the torque late, or was a channel filtered? "
                    "Do not trust these numbers"
                )
            elif name in COEFFICIENTS:
                kind = "windowed" if name == "stiffness" else "auto"
                words.append(
                    f"{name}{NOT_CONSTANT} by {one.test.spread:.0%}: give {name}={kind!r}, or split the record"
                )
            else:
                words.append(
                    f"{name} was taken as constant, but differs between parts of the record: something drifts, or a term is missing"
                )
        return words

    def _free_offset(self) -> list[str]:
        if self.found.free_offset is None:
            return []
        errors = self.found.free_offset
        others = [name for name in self.names if name not in {*COEFFICIENTS, OFFSET}]
        words = (
            f"{FREE_OFFSET}: its cross-validation error is {errors.free:.2f} times the variance "
            f"of the noise, not {errors.used:.2f}: give terms={[*others, (OFFSET, 'windowed')]}"
        )
        return [words]

    def _chance(self) -> list[str]:
        return [f"do not trust these numbers: {self._unexplained()}"] if self.found.unexplained else []

    def _limits(self, flags: Status) -> list[str]:
        if Status.WINDOW_LIMIT not in flags:
            return []
        lengths = [one.samples for one in self.found.lengths]
        if lengths and self.found.regression_window <= min(lengths):
            if all(one.kind != "windowed" for one in self.found.unknowns):
                return []
            words = (
                f"windows of {self.found.regression_window} samples are the shortest that were tried: windowed parameters change too fast "
                "to be followed, or the record is too short: record ten cycles or more, and excite higher frequencies"
            )
        else:
            words = (
                f"a test function of {self.found.window_length} samples is the shortest or longest that was tried: record ten "
                "cycles or more, with 20 samples or more per cycle; do not trust these numbers otherwise"
            )
        return [words]


def _times_noise(error: float) -> str:
    """Return how many times the variance of the noise something is, in words."""
    many = "more than a million" if error > _COUNTED else f"{error:.3g}"
    return f"{many} times the variance of the noise"
