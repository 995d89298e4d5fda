"""What a fit of expansions found, as results have it: curves, values and errors at the samples, status, settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._expansion import (
    ExpandedUnknown,
    Fitted,
    Linearised,
    Rivals,
    Tried,
    along_record,
    condition_of_curves,
    curve_along,
    placed,
    reach_over,
)
from tvident._identify.expanded_inputs import ExpandedInputs
from tvident._results import Estimates, ExpandedParameter, of_powers
from tvident._status import Status, untold_samples
from tvident._units import unit_said

Array = npt.NDArray[np.float64]

_JUMPS = 2.0
"""Standard errors that a jump of windows must be large for an expansion to have to follow it."""

_FOLLOWED = 0.5
"""Of a jump, by which an expansion must change within the test function to follow it."""

_HARDLY_KNOWN = 0.1
"""Error, as a part of what a parameter usually is, from which on nothing is known of it where windows know nothing."""

_FAR_LESS_KNOWN = 10.0
"""Error over what it usually is, from which on nothing is known where it is larger than the parameter usually is, too."""

_DOUBTS = Status.KIND_CONTRADICTED | Status.SCALES_DISAGREE
"""Flags of windows that hold for smooth functions of time, too."""

_KEPT = Status.COLOURED | Status.CHANNEL_SUSPECTED
"""Flags that windows found of the channels, whatever the equation."""


@dataclass(frozen=True)
class ExpandedOutcome:
    """What a fit found.

    Parameters
    ----------
    given : ExpandedInputs
    unknowns : sequence of ExpandedUnknown
    fitted : Fitted
    around : Linearised
        The rows around what was found.
    tried : sequence of Tried
    rivals : mapping of str to Rivals
        Curves of other sizes.
    """

    given: ExpandedInputs
    unknowns: Sequence[ExpandedUnknown]
    fitted: Fitted
    around: Linearised
    tried: Sequence[Tried]
    rivals: Mapping[str, Rivals]

    @property
    def ratio(self) -> float:
        """The mean square of the residuals over that of the noise."""
        free = self.fitted.observations - sum(one.size for one in self.unknowns)
        return self.fitted.misfit / free if free > 0 else float("nan")

    @cached_property
    def condition(self) -> float:
        """The condition number of the equations, in the better of two bases: the functions as they are, or orthonormal ones."""
        as_they_are = self.fitted.condition
        if not _core.HARDLY_TOLD_APART < as_they_are < np.inf:
            return as_they_are
        return min(as_they_are, condition_of_curves(self.unknowns, self.fitted.root, self.given.record.usable[0]))

    def with_errors_of_residuals(self) -> ExpandedOutcome:
        """Return the same with errors that know of residuals larger than the noise, and of their correlation."""
        if not self.ratio > 1:
            return self
        root = (
            self.around.root_of_residuals(self.unknowns, self.fitted)
            if self.ratio > _core.NOISE_MODEL_FAILS
            else self.fitted.root * np.sqrt(self.ratio)
        )
        return replace(self, fitted=replace(self.fitted, root=root))

    @cached_property
    def curves(self) -> dict[str, ExpandedParameter]:
        """Every expansion as a curve."""
        found = {}
        for one, place in placed(self.unknowns):
            if one.basis is None:
                continue
            expansion = self.given.expansions[one.name]
            own, root = self.fitted.values[place], self.fitted.root[place]
            covariance = np.asarray(root @ root.T)
            sizes = [each.sizes[one.name] for each in self.tried]
            limits = tuple(each.limits for each in one.basis.coordinates)
            shown = of_powers(own, covariance) if expansion.is_of_powers else (own, covariance)
            found[one.name] = ExpandedParameter(
                name=one.name,
                family=expansion.called,
                coefficients=shown[0],
                covariance=shown[1],
                sizes={
                    "size": np.array([each[0] if len(each) == 1 else each for each in sizes]),
                    "criterion": np.array([each.criterion for each in self.tried]),
                    "residual": np.array([each.residual for each in self.tried]),
                    "parameters": np.array([each.parameters for each in self.tried]),
                    "weight": np.array([each.weight for each in self.tried]),
                },
                limits=limits[0] if len(limits) == 1 else limits,
                unit=self.given.data.units.get(one.name, ""),
                unit_of="s" if expansion.is_of_time else unit_said(expansion.of),
                _basis=one.basis,
                _own=own,
                _own_root=root,
                _rivals=self.rivals.get(one.name, Rivals()),
            )
        return found

    def estimates(self) -> Estimates:
        """Return values and errors at the samples."""
        given, step = self.given, slice(None, None, self.given.data.step)
        count = given.data.time[step].size
        values: dict[str, Array] = {}
        errors: dict[str, Array] = {}
        constants: dict[str, tuple[Any, Any]] = {}
        for one, place in placed(self.unknowns):
            own, root = self.fitted.values[place], self.fitted.root[place]
            if one.basis is None:
                constants[one.name] = (float(own[0]), float(np.linalg.norm(root[0])))
                values[one.name], errors[one.name] = (np.full(count, number) for number in constants[one.name])
            else:
                along = curve_along(one.basis, own, root, self.rivals.get(one.name, Rivals()))
                values[one.name], errors[one.name] = (each[step] for each in along)
        if "angle_zero" in constants:
            moved, error = constants["angle_zero"]
            constants["angle_zero"] = (given.zero + moved, error)
            del values["angle_zero"], errors["angle_zero"]
        for name, value in given.known_values.items():
            values[name], errors[name] = np.array(value[step]), np.zeros(count)
        kinds = {name: np.array(kind) for name, kind in self._kinds().items()}
        # Inner parameters of terms were found beside windows, and hold here.
        for name in given.pilot.settings["inner"]:
            constants[name], kinds[name] = given.pilot.constants[name], np.array("constant")
            values[name], errors[name] = (np.full(count, number) for number in constants[name])
        left = self.around.residuals
        return replace(
            given.pilot._found,  # noqa: SLF001 - parts of this package
            values=values,
            errors=errors,
            factors={},
            covariances=self._covariances(),
            constants=constants,
            condition=np.full(count, self.condition),
            residual_std=np.full(count, float(np.std(left)) if left.size else np.nan),
            order=np.zeros(count, np.uint8),
            status=self._status(values, errors, step),
            record_status=self._record_status(),
            expansions=self.curves,
            kinds=kinds,
        )

    def settings(self, name: str) -> dict[str, Any]:
        """Return inputs and choices, of a method of this name."""
        before = dict(self.given.pilot.settings)
        kinds = {**dict.fromkeys(COEFFICIENTS, "known"), **self._kinds()}
        sizes = {
            name: {"family": one.family, "size": one.size, "limits": one.limits} for name, one in self.curves.items()
        }
        return {
            **before,
            "method": name,
            "kinds": kinds,
            "terms": [[term, kinds[term]] for term, _ in before["terms"]],
            "expansions": sizes,
            "step": self.given.data.step,
            "chosen": [one for one in before["chosen"] if one != "regression_window"],
        }

    def against_windows(self, name: str, found: Estimates) -> tuple[float, int]:
        """Return the mean squared difference from windows over its variance, and at how many windows, which hardly share equations."""
        pilot = self.given.pilot
        if str(pilot.settings["kinds"].get(name)) != "windowed" or self.given.data.step > 1:
            return float("nan"), 0
        rows = int(pilot.settings["regression_window"]) + int(pilot.settings["window_length"])
        apart = slice(rows // 2, None, max(1, rows))
        value = getattr(pilot, name) if name in COEFFICIENTS else pilot.terms[name]
        there = pilot.trusted[apart] & np.isfinite(found.values[name][apart])
        if not there.any():
            return float("nan"), 0
        variance = pilot.stderr[name][apart] ** 2 + found.errors[name][apart] ** 2
        squares = ((value[apart] - found.values[name][apart]) ** 2 / variance)[there]
        return float(np.mean(squares)), int(there.sum())

    @property
    def doubts_of_windows(self) -> Status:
        """What windows of time say against functions of time in their place: parts of the record, or scales, find other parameters.

        A function of a channel may follow what no window does.
        """
        if not all(one.is_of_time for one in self.given.expansions.values()):
            return Status(0)
        return Status(int(np.asarray(self.given.pilot.record_status))) & _DOUBTS

    def missed_jumps(self, name: str, found: Estimates) -> tuple[float, ...]:
        """Return the seconds at which windows jump and the expansion does not, within the test function that sees both."""
        pilot = self.given.pilot
        if str(pilot.settings["kinds"].get(name)) != "windowed" or self.given.data.step > 1:
            return ()
        half = int(pilot.settings["window_length"]) // 2
        windows, errors = getattr(pilot, name) if name in COEFFICIENTS else pilot.terms[name], pilot.stderr[name]
        missed = []
        for jump in pilot.jumps:
            # The first sample after it.
            at = int(np.searchsorted(pilot.time, jump))
            before, after = max(at - half, 0), min(at + half, pilot.time.size - 1)
            if not 0 < at < pilot.time.size:
                continue
            # Beside it few equations are left, since no test function may reach over it.
            size = windows[after] - windows[before]
            known = abs(size) > _JUMPS * np.hypot(errors[after], errors[before])
            follows = (found.values[name][after] - found.values[name][before]) / size
            if known and not follows > _FOLLOWED:
                missed.append(float(jump))
        return tuple(missed)

    def _kinds(self) -> dict[str, str]:
        return {
            one.name: "constant" if one.basis is None else "expanded"
            for one in self.unknowns
            if one.name != "angle_zero"
        }

    def _status(self, values: dict[str, Array], errors: dict[str, Array], step: slice) -> npt.NDArray[np.uint16]:
        """Return the flags of samples, and make values without an error none."""
        status = np.where(self.given.record.usable[0, step], np.uint16(0), np.uint16(Status.GAP)).astype(np.uint16)
        for name, expansion in self.given.expansions.items():
            for channel in expansion.channels:
                values[name] = np.where(np.isfinite(channel[step]), values[name], np.nan)
        for name, value in values.items():
            missing = ~(np.isfinite(value) & np.isfinite(errors[name]))
            values[name], errors[name] = np.where(missing, np.nan, value), np.where(missing, np.nan, errors[name])
            status[missing] |= np.uint16(Status.INVALID)
        status[self._untold(values, errors, step)] |= np.uint16(Status.ILL_CONDITIONED)
        return status

    def _untold(self, values: Mapping[str, Array], errors: Mapping[str, Array], step: slice) -> npt.NDArray[np.bool_]:
        """Return where the motion tells nothing of what is expanded, and no function reaches over it.

        Windows in its place know nothing there, or what it multiplies is noise. That noise would make errors small, and an inertia zero:
        errors are at least those that the motion elsewhere leaves.
        """
        of_windows = untold_samples(self.given.pilot.status[step])
        found: npt.NDArray[np.bool_] = np.zeros(of_windows.shape, np.bool_)
        for one in self.unknowns:
            if one.basis is None:
                continue
            moves, reach = np.ones(found.shape, np.bool_), np.ones(found.shape)
            if one.entries[0][1] != "term":
                moving = self.given.record.moves(one.entries, self.given.noise[0])
                if not moving.all():
                    moves, reach = moving[step], reach_over(one.basis, moving & self.given.record.usable[0])[step]
            dark = of_windows | ~moves
            value, error = values[one.name], errors[one.name]
            known = ~dark & np.isfinite(value)
            if known.any():
                usual, known_to = np.median(np.abs(value[known])), np.median(error[known])
                least = np.where(moves, error, np.maximum(error, known_to * reach))
                found |= least > np.where(dark, _HARDLY_KNOWN * usual, max(usual, _FAR_LESS_KNOWN * known_to))
        return found

    def _record_status(self) -> Status:
        flags = Status(int(np.asarray(self.given.pilot.record_status))) & _KEPT
        if self.given.data.doubts:
            flags |= Status.CHANNEL_SUSPECTED
        if not np.isfinite(self.condition):
            flags |= Status.RANK_DEFICIENT
        elif self.condition > _core.HARDLY_TOLD_APART:
            flags |= Status.ILL_CONDITIONED
        if self.ratio > _core.NOISE_MODEL_FAILS:
            flags |= Status.NOISE_MODEL
        return flags

    def _covariances(self) -> dict[frozenset[str], Array]:
        """Return covariances of pairs of coefficients at every sample."""
        step = slice(None, None, self.given.data.step)
        samples = self.given.data.time.size
        coefficients = [(one, place) for one, place in placed(self.unknowns) if one.name in COEFFICIENTS]
        found = {}
        for (one, rows), (other, columns) in combinations(coefficients, 2):
            block = self.fitted.covariance[rows, columns]
            total = np.zeros(samples)
            for number, row in enumerate(block):
                before = 1.0 if one.basis is None else along_record(one.basis, np.eye(len(block))[number])
                after = float(row[0]) if other.basis is None else along_record(other.basis, row)
                total += before * after
            found[frozenset((one.name, other.name))] = total[step]
        return found
