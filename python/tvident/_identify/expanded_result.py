"""What a fit of expansions found, as results have it: curves, values and errors at the samples, status, settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._identify.expanded_inputs import ExpandedInputs
from tvident._results import Estimates, ExpandedFit, WindowsBeside, unflagged
from tvident._status import Status

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ExpandedOutcome:
    """What a fit found of one record.

    Parameters
    ----------
    given : ExpandedInputs
    fit : ExpandedFit
    """

    given: ExpandedInputs
    fit: ExpandedFit

    def estimates(self) -> Estimates:
        """Return values and errors at the samples."""
        given, step = self.given, slice(None, None, self.given.data.step)
        count = given.data.time[step].size
        values: dict[str, Array] = {}
        errors: dict[str, Array] = {}
        constants: dict[str, tuple[Any, Any]] = {}
        for one, value, error in self.fit.values_and_errors(step):
            if one.basis is None:
                constants[one.name] = (float(value[0]), float(error[0]))
                values[one.name], errors[one.name] = (np.full(count, number) for number in constants[one.name])
            else:
                values[one.name], errors[one.name] = value, error
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
        left = self.fit.around.residuals
        return replace(
            given.pilot._found,  # noqa: SLF001 - parts of this package
            values=values,
            errors=errors,
            factors={},
            covariances=self._covariances(step),
            constants=constants,
            condition=np.full(count, self.fit.condition),
            residual_std=np.full(count, float(np.std(left)) if left.size else np.nan),
            order=np.zeros(count, np.uint8),
            status=self.fit.without_untold(values, errors, given.pilot.status, step),
            record_status=self._record_status(),
            expansions=self.fit.curves,
            kinds=kinds,
        )

    def settings(self, name: str) -> dict[str, Any]:
        """Return inputs and choices, of a method of this name."""
        before = dict(self.given.pilot.settings)
        kinds = {**dict.fromkeys(COEFFICIENTS, "known"), **self._kinds()}
        sizes = {
            name: {"family": one.family, "size": one.size, "limits": one.limits}
            for name, one in self.fit.curves.items()
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

    def windows(self, name: str) -> WindowsBeside | None:
        """Return windows in the place of an expansion; None where there are none at its samples."""
        pilot = self.given.pilot
        if str(pilot.settings["kinds"].get(name)) != "windowed" or self.given.data.step > 1:
            return None
        length = int(pilot.settings["window_length"])
        return WindowsBeside(
            getattr(pilot, name) if name in COEFFICIENTS else pilot.terms[name],
            pilot.stderr[name],
            unflagged(pilot),
            int(pilot.settings["regression_window"]) + length,
            length // 2,
            # The first sample after each.
            [int(np.searchsorted(pilot.time, jump)) for jump in pilot.jumps],
        )

    @property
    def doubts_of_windows(self) -> Status:
        """What windows of time say against functions of time in their place."""
        return self.fit.doubts(self._status_of_windows)

    @property
    def _status_of_windows(self) -> Status:
        return Status(int(np.asarray(self.given.pilot.record_status)))

    def _kinds(self) -> dict[str, str]:
        return {
            one.name: "constant" if one.basis is None else "expanded"
            for one in self.fit.unknowns
            if one.name != "angle_zero"
        }

    def _record_status(self) -> Status:
        of_times = Status.CHANNEL_SUSPECTED if self.given.data.doubts else Status(0)
        return of_times | self.fit.flags(self._status_of_windows)

    def _covariances(self, step: slice) -> dict[frozenset[str], Array]:
        """Return covariances of pairs of coefficients at the samples that are wanted."""
        return {frozenset(pair): values[step] for pair, values in self.fit.covariances(COEFFICIENTS).items()}
