"""Inertia, damping and stiffness that change by one factor: the gain of a channel changes, and not the machine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._advice.events import jumps_beside_pulses
from tvident._arguments import listed
from tvident._equation import COEFFICIENTS

Array = npt.NDArray[np.float64]

_ONE_FACTOR = 0.2
"""Inertia and stiffness change by one factor where they differ from it by less than this part of its change."""

_CHANGES = 0.003
"""A factor that changes by less is not worth a word: by how much it jumps, or the root of its mean squared change."""

_BEYOND_CHANCE = 4.0
"""A change counts where it is larger than so many relative standard errors: errors of inertia and stiffness look like one factor, too."""

_AGREES = 2.0
"""Damping changes by the same factor where it differs from it by less than so many of its relative standard errors."""

_JUMPS_ALIKE = 3.0
"""Parameters jump by the same factor where they differ from it by less than so many standard errors of the difference."""

_CLEARLY = 2.0
"""Damping tells of one factor where its errors are smaller than what changes by so much."""

_AS_KNOWN = 2.0
"""A drift is looked for where errors are at most so many times the usual one."""

_RATHER = {1: "both", 2: "all three"}
"""What changes in truth where a gain does not, by how many parameters follow the inertia."""

_TRUSTED = "calibrate the channels; only ratios can be trusted, such as the natural frequency"


@dataclass(frozen=True)
class Gains:
    """Changes of inertia, damping and stiffness that look like one of a channel's gain.

    Parameters
    ----------
    unknowns : mapping of str to _core.Unknown
        By name.
    jumps : sequence of int
        Samples before which parameters jump.
    reach : int
        Samples on either side of a jump that hold a mixture of both sides.
    period, step : float, int
        Seconds from one sample to the next; samples from one number to the next.
    """

    unknowns: Mapping[str, _core.Unknown]
    jumps: Sequence[int]
    reach: int
    period: float
    step: int

    def words(self) -> list[str]:
        """Return that a gain jumps or drifts, and what to do."""
        jumps = {jump: factor for jump in self.jumps if (factor := self._factor_at(jump)) is not None}
        if not jumps:
            return self._drift()
        changing = list(self._changing())
        times = ", ".join(f"{jump * self.period:.6g} s ({factor - 1:+.2%})" for jump, factor in jumps.items())
        words = (
            f"{listed(changing)} jump by one factor, at {times}: the gain of the torque or of the angle seems to change there, rather than "
            f"{_RATHER[len(changing) - 1]}: identify the parts on either side, or {_TRUSTED}"
        )
        return [words]

    def _changing(self) -> dict[str, _core.Unknown]:
        """Return the parameters that are not constant."""
        there = ((name, self.unknowns.get(name)) for name in COEFFICIENTS)
        return {name: one for name, one in there if one is not None and one.kind != "constant"}

    def _factor_at(self, jump: int) -> float | None:
        """Return the factor by which all that changes is another one after a jump; None if there is not one."""
        changing = self._changing()
        if not {"inertia", "stiffness"} <= set(changing):
            return None
        changes, errors = zip(*(self._change_at(one, jump) for one in changing.values()), strict=True)
        inertia, error = changes[0], errors[0]
        is_one = all(
            abs(one - inertia) < max(_ONE_FACTOR * abs(inertia), _JUMPS_ALIKE * math.hypot(its, error))
            for one, its in zip(changes, errors, strict=True)
        )
        is_clear = (
            abs(inertia) > max(_CHANGES, _BEYOND_CHANCE * error) and abs(changes[-1]) > _BEYOND_CHANCE * errors[-1]
        )
        return (2 + inertia) / (2 - inertia) if is_one and is_clear else None

    def _change_at(self, one: _core.Unknown, jump: int) -> tuple[float, float]:
        """Return by how much a parameter jumps, relative to the mean of both sides, and the standard error of that."""
        last = one.values.size - 1
        sides = [min(max(sample // self.step, 0), last) for sample in (jump - self.reach, jump + self.reach)]
        before, after = one.values[sides]
        mean = (before + after) / 2
        return float((after - before) / mean), float(one.factor * math.hypot(*one.stderr[sides]) / abs(mean))

    def _drift(self) -> list[str]:
        """Return that a gain may drift, where inertia and another one change by one factor, or damping and stiffness."""
        changing = self._changing()
        if not {"inertia", "stiffness"} <= set(changing):
            return []
        there = np.logical_and.reduce([np.isfinite(one.values) & np.isfinite(one.stderr) for one in changing.values()])
        if not there.any():
            return []
        errors = {name: one.stderr * one.factor / abs(np.mean(one.values[there])) for name, one in changing.items()}
        # An inertia may change beside a gain, too; then damping and stiffness tell.
        values = {name: one.values for name, one in changing.items()}
        return self._following("inertia", there, values, errors) or self._following("stiffness", there, values, errors)

    def _following(
        self, first: str, there: npt.NDArray[np.bool_], values: Mapping[str, Array], errors: Mapping[str, Array]
    ) -> list[str]:
        """Return that a gain may drift, where others change by the factor of the first."""
        # Near the ends little is known, and curves go astray.
        known = there & (errors[first] <= _AS_KNOWN * np.median(errors[first][there]))
        changes = {name: one[known] / np.mean(one[known]) - 1 for name, one in values.items()}
        error = {name: _root_mean_square(one[known]) for name, one in errors.items()}
        by = changes[first]
        change = _root_mean_square(by)
        if not change > max(_CHANGES, _BEYOND_CHANCE * error[first]):
            return []
        follow = []
        # Damping is known worst, and says nothing where its errors are nearly as large as what changes.
        if "damping" in changes and error["damping"] < change / _CLEARLY:
            away = _root_mean_square(changes["damping"] - by)
            follow += ["damping"] if away < _AGREES * error["damping"] else []
        # A stiffness may change of its own, too; then damping tells.
        if first == "inertia" and _root_mean_square(changes["stiffness"] - by) < _ONE_FACTOR * change:
            follow += ["stiffness"]
        if not follow:
            return []
        rather = _RATHER[len(follow)]
        if first != "inertia":
            rather = f"{rather}, beside an inertia that changes (or damping follows stiffness, as in rubber and muscle)"
        words = (
            f"{listed(sorted([first, *follow], key=COEFFICIENTS.index))} change by one factor ({np.min(by):+.1%} to {np.max(by):+.1%}): "
            f"the gain of the torque or of the angle seems to drift or jump, rather than {rather}: {_TRUSTED}"
        )
        return [words]


@np.errstate(all="ignore")
def changes_of_gain(found: _core.Identification, names: Sequence[str], period: float, step: int) -> list[str]:
    """Return that the gain of a channel seems to change in one record, and what to do.

    Parameters
    ----------
    found : _core.Identification
    names : sequence of str
        What its unknowns are called.
    period, step : float, int
        Seconds from one sample to the next; samples from one number to the next.
    """
    # Inner parameters of terms come after what has a name.
    unknowns = dict(zip(names, found.unknowns, strict=False))
    return Gains(unknowns, jumps_beside_pulses(found), found.window_length // 2, period, step).words()


def _root_mean_square(values: npt.NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
