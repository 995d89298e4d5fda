"""Sheets of workbooks, as text: what columns hold and are called is found there as in any text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from datetime import datetime, time, timedelta
from typing import Any

from tvident._formats.told import Sheet

_OF_THE_FULLEST = 0.1
"""A sheet with fewer numbers than this part of the fullest describes the recording rather than being it."""

_ERRORS = frozenset(("#N/A", "#DIV/0!", "#REF!", "#VALUE!", "#NUM!", "#NAME?", "#NULL!"))
_IS_ERROR = re.compile("#(?:[A-Z_/0]+[!?]|N/A)")
"""What cells say whose formula found no number; newer programs have more words."""

_BREAKS = str.maketrans({"\t": " ", "\n": " ", "\r": " ", '"': "'", "#": " "})


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the first sheet that holds a recording, as text whose cells tabs separate."""
    from openpyxl import load_workbook  # noqa: PLC0415 - an extra

    book = load_workbook(path, read_only=True, data_only=True)
    # A sheet that is compared with no other need have one number.
    enough = math.inf if len(book.worksheets) > 1 else 1
    sheets = [_Counted(sheet, enough) for sheet in book.worksheets]
    least = max(1.0, _OF_THE_FULLEST * max((one.numbers for one in sheets), default=0))
    given = next((one for one in sheets if one.numbers >= least), None)
    if given is not None:
        skipped += [f"sheet {one.sheet.title}" for one in sheets if one is not given and one.cells]
        yield given.sheet.title, Sheet(_text(given.sheet))


class _Counted:
    """A sheet and how much it holds: text is made of the one that is chosen alone, which is read again."""

    def __init__(self, sheet: Any, enough: float) -> None:
        self.sheet = sheet
        self.cells = self.numbers = 0
        for row in sheet.iter_rows(values_only=True):
            for value in row:
                self.cells += value is not None
                self.numbers += _is_number(value)
            if self.numbers >= enough:
                break


def _text(sheet: Any) -> str:
    rows = [[_cell(value) for value in row] for row in sheet.iter_rows(values_only=True)]
    width = max(index + 1 for row in rows for index, cell in enumerate(row) if cell)
    return "".join("\t".join((row + [""] * width)[:width]) + "\n" for row in rows)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | time):
        return value.isoformat()
    if isinstance(value, bool | float | int | timedelta):
        return repr(value.total_seconds() if isinstance(value, timedelta) else +value)
    text = str(value)
    if _IS_ERROR.fullmatch(text):
        # What a formula could not compute is no number, whatever it is called.
        return text if text in _ERRORS else "#VALUE!"
    return text.translate(_BREAKS).strip()


def _is_number(value: Any) -> bool:
    if not isinstance(value, str):
        return isinstance(value, bool | float | int | timedelta)
    try:
        float(value)
    except ValueError:
        return False
    return True
