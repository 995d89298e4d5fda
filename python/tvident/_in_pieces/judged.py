"""The verdict on a long record, by rows that are spread over it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._identify import CONTRADICTED
from tvident._pieces import Columns
from tvident._results import (
    CHANGING,
    SYMBOLS,
    found_elsewhere,
    found_marked,
    known_to,
    mostly_flagged,
    negative,
    relative_error,
    verdict_of_distrusted,
    verdict_of_trusted,
    why_not,
)
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD, Status
from tvident._units import in_words_of


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
    record_status: Status
    advice: Sequence[str]
    settings: Mapping[str, Any]
    units: Mapping[str, str]

    @property
    def status(self) -> npt.NDArray[np.uint16]:
        """Flags of the rows."""
        return np.asarray(self.columns["status"], np.uint16)

    @property
    def _unflagged(self) -> npt.NDArray[np.bool_]:
        good = (self.status & np.uint16(DOUBTFUL) == 0) & (not self.record_status & DOUBTFUL_RECORD)
        for name in COEFFICIENTS:
            good &= np.isfinite(self.columns[name])
        return np.asarray(good)

    def verdict(self) -> str:
        """Return how well parameters are known, or why not to trust them."""
        reason = (
            found_marked(self.advice)
            or why_not(self, self._sign, lambda: None)
            or mostly_flagged(self)
            or found_elsewhere(self.advice)
        )
        words = verdict_of_distrusted(self, reason) if reason else verdict_of_trusted(self, self._known(), None)
        return in_words_of(self.units, words)

    def _kinds(self) -> dict[str, str]:
        kinds: Mapping[str, str] = self.settings["kinds"]
        return {name: kinds[name] for name in SYMBOLS if kinds[name] != "known"}

    def _sign(self) -> str | None:
        """Return which parameter has a sign that no machine has, in words."""
        good = self._unflagged if self._unflagged.any() else np.ones(self.status.size, bool)
        is_contradicted = self.settings["form"] == "strong" or bool(self.record_status & CONTRADICTED)
        for name in self._kinds():
            value, error = (self.columns[of][good] for of in (name, f"{name}_stderr"))
            words = negative(value, error)
            if name != "stiffness" and words:
                return f"{name} {words}"
            if name == "stiffness" and is_contradicted and words and negative(-value, error):
                return "stiffness has both signs"
        return None

    def _known(self) -> str:
        found = []
        for name, kind in self._kinds().items():
            relative = relative_error(self.columns[name], self.columns[f"{name}_stderr"], self._unflagged)
            if relative is not None:
                found.append((f"{SYMBOLS[name]}(t)" if kind in CHANGING else SYMBOLS[name], relative))
        return known_to(found)
