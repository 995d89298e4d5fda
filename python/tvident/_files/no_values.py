"""What stands in a file where a value is missing: words of instruments and spreadsheets, numbers that mark it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from tvident._arguments import CLOSE_TO_MARK, is_several, marks_in, real_number
from tvident._files.cells import is_error, says_no_number
from tvident._files.names import printable


class Unmeasured:
    """Counts cells that say why they hold no number."""

    def __init__(self) -> None:
        self._first: dict[bool, str] = {}
        """Where the first stands: of errors of a spreadsheet, and of others."""
        self._count: dict[bool, int] = {}

    def note(self, place: int, name: str, cell: str) -> None:
        """Keep a cell in which a reason stands."""
        if says_no_number(cell):
            of_sheet = is_error(cell)
            where = f"'{printable(cell, 40)}' in line {place}, column '{printable(name, 40)}'"
            self._first.setdefault(of_sheet, where)
            self._count[of_sheet] = self._count.get(of_sheet, 0) + 1

    def said(self) -> list[str]:
        """Return what was read as missing."""
        messages = []
        for of_sheet, where in self._first.items():
            count = self._count[of_sheet]
            several = f"{count} cells hold" if count > 1 else "one cell holds"
            what = "errors" if count > 1 else "an error"
            why = f"{what} of a spreadsheet" if of_sheet else "a word in place of a number"
            messages.append(f"{several} {why}, read as missing: {where}")
        return messages


def said_of_marks(channels: Mapping[str, npt.NDArray[np.number]]) -> list[str]:
    """Return questions about numbers that may mark missing values."""
    messages = []
    for name, values in channels.items():
        for mark, count in marks_in(values):
            often = "once" if count == 1 else f"{count} times"
            messages.append(
                f"channel '{printable(name, 40)}' holds {mark:.9g} {often}, far from all its other values: if it marks values that are "
                f"missing, read the file with missing={mark:.9g}"
            )
    return messages


def marks_given(missing: object) -> list[float]:
    """Return the numbers that mark missing values, as they were given."""
    each = list(missing) if is_several(missing) else [missing]  # type: ignore[call-overload]
    return [real_number("missing", one) for one in each]


def without_marks(values: npt.NDArray[np.number], marks: Sequence[float]) -> npt.NDArray[np.number]:
    """Return a channel with NaN in place of numbers that mark missing values."""
    if values.dtype.kind not in "iuf":
        return values
    are_marks = np.zeros(values.shape, dtype=bool)
    for mark in marks:
        are_marks |= np.isclose(np.asarray(values, np.float64), mark, rtol=CLOSE_TO_MARK, atol=0)
    return np.where(are_marks, np.nan, values) if are_marks.any() else values
