"""The verdict on a long record, by rows that are spread over it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._advice import asked_of_signs, certain_sign
from tvident._equation import COEFFICIENTS
from tvident._pieces import Columns
from tvident._results import (
    found_elsewhere,
    found_marked,
    how_well_known,
    mostly_flagged,
    unfollowed,
    verdict_of_distrusted,
    verdict_of_trusted,
    why_not,
    wrong_sign,
)
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD
from tvident._units import in_words_of

_LOOK = "identify a stretch of it in memory, of read_recording(…).select(0, 60), say: its summary() tries what would explain that"
"""What to do where nothing else was found."""

_MOSTLY = 0.5


@dataclass(frozen=True)
class JudgedRows:
    """What is known of a long record.

    Parameters
    ----------
    columns : mapping of str to ndarray
        Of rows that are spread over it.
    record_status : Status
    advice : sequence of str
    settings : mapping
    units : mapping of str to str
    """

    columns: Columns
    record_status: Any
    advice: Sequence[str]
    settings: Mapping[str, Any]
    units: Mapping[str, str]

    @property
    def status(self) -> npt.NDArray[np.uint16]:
        """Flags of the rows."""
        return np.asarray(self.columns["status"], np.uint16)

    @property
    def inertia(self) -> npt.NDArray[np.float64]:
        """Of the rows."""
        return self.columns["inertia"]

    @property
    def damping(self) -> npt.NDArray[np.float64]:
        """Of the rows."""
        return self.columns["damping"]

    @property
    def stiffness(self) -> npt.NDArray[np.float64]:
        """Of the rows."""
        return self.columns["stiffness"]

    @property
    def stderr(self) -> Mapping[str, npt.NDArray[np.float64]]:
        """Standard errors of the rows, by parameter."""
        return {name: self.columns[f"{name}_stderr"] for name in COEFFICIENTS}

    @property
    def _unflagged(self) -> npt.NDArray[np.bool_]:
        good = (self.status & np.uint16(DOUBTFUL) == 0) & (not self.record_status & DOUBTFUL_RECORD)
        for name in COEFFICIENTS:
            good &= np.isfinite(self.columns[name])
        return np.asarray(good)

    @property
    def _reason(self) -> str | None:
        """Why nothing is to be trusted, by the rules for a recording in memory; None where nothing says so."""
        return (
            found_marked(self.advice)
            or why_not(self, lambda: wrong_sign(self), lambda: None)
            or mostly_flagged(self)
            or found_elsewhere(self.advice)
            or unfollowed(self.advice)
        )

    @property
    def is_doubted(self) -> bool:
        """Whether nothing is to be trusted, or the stiffness is sought and less than its error at most rows."""
        values, errors = self.stiffness, self.stderr["stiffness"]
        known = np.isfinite(values) & np.isfinite(errors)
        lost = int(np.count_nonzero(errors[known] > np.abs(values[known])))
        is_sought = self.settings["kinds"]["stiffness"] != "known"
        return self._reason is not None or bool(is_sought and lost > _MOSTLY * int(np.count_nonzero(known)))

    def verdict(self) -> str:
        """Return how well parameters are known, or why not to trust them."""
        reason = self._reason
        words = verdict_of_distrusted(self, reason) if reason else verdict_of_trusted(self, how_well_known(self), None)
        return in_words_of(self.units, words)

    def with_cure(self, first: Sequence[str] = ()) -> JudgedRows:
        """Return the same with what comes first and what explains a sign that no machine has before its advice, and never without any."""
        kinds = self.settings["kinds"]
        signs = {
            name: certain_sign(getattr(self, name), self.stderr[name]) if kinds[name] != "known" else 0
            for name in COEFFICIENTS
        }
        asked = [in_words_of(self.units, line) for line in asked_of_signs(signs)]
        # Stretches may have said it, in the same words behind other names.
        unsaid = [line for line in asked if not any(line.partition(": ")[2] in one for one in self.advice)]
        advice = [*first, *unsaid, *self.advice]
        return replace(self, advice=advice or ([_LOOK] if self._reason else []))
