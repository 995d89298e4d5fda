"""Sheets of workbooks, as text: what columns hold and are called is found there as in any text."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, time, timedelta
from typing import Any

from tvident._formats.told import Sheet

_BREAKS = str.maketrans({"\t": " ", "\n": " ", "\r": " ", '"': "'", "#": " "})


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the first sheet that holds numbers, as text whose cells tabs separate."""
    from openpyxl import load_workbook  # noqa: PLC0415 - an extra

    book = load_workbook(path, read_only=True, data_only=True)
    given = ""
    for sheet in book.worksheets:
        rows = [] if given else [[_cell(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
        width = max((index + 1 for row in rows for index, cell in enumerate(row) if cell), default=0)
        if any(_is_number(cell) for row in rows for cell in row):
            given = sheet.title
            lines = ["\t".join((row + [""] * width)[:width]) for row in rows]
            yield sheet.title, Sheet("\n".join(lines) + "\n")
        elif given:
            skipped.append(f"sheet {sheet.title}")


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | time):
        return value.isoformat()
    if isinstance(value, bool | float | int | timedelta):
        return repr(value.total_seconds() if isinstance(value, timedelta) else +value)
    text = str(value).translate(_BREAKS).strip()
    # What a formula could not compute is no number.
    return "" if str(value).startswith("#") and str(value).endswith(("!", "?", "A")) else text


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
