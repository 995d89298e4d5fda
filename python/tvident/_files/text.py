"""Columns of numbers in text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tvident._files.channels import Channels


def read_text(path: Path) -> Channels:
    """Read columns of numbers, with or without names, separated by commas, semicolons, tabs or blanks."""
    encoding = _encoding(path)
    with path.open(encoding=encoding) as file:
        lines = [line for _, line in zip(range(200), file, strict=False)]
    for separator in (",", ";", "\t", None):
        start, width = _first_numbers(lines, separator)
        if width > 1 or (width == 1 and separator is None):
            break
    if not width:
        return {}
    names = _names(lines[:start], separator, width)
    numbers = np.genfromtxt(
        path,
        delimiter=separator,
        skip_header=start,
        encoding=encoding,
        comments="#",
        ndmin=2,
        invalid_raise=True,
    )
    return dict(zip(names, numbers.T, strict=True))


def _encoding(path: Path) -> str:
    """Return how a text is encoded: UTF-8, or else the Western European alphabet of older programs."""
    with path.open(encoding="utf-8-sig") as file:
        try:
            for _ in file:
                pass
        except UnicodeDecodeError:
            return "latin-1"
    return "utf-8-sig"


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip("\"'") for cell in line.strip().rstrip(separator or " ").split(separator)]


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _first_numbers(lines: list[str], separator: str | None) -> tuple[int, int]:
    """Return the first line that holds numbers only, and how many."""
    for index, line in enumerate(lines):
        cells = _cells(line, separator)
        if line.strip() and not line.startswith("#") and any(cells) and all(_is_number(cell) for cell in cells):
            return index, len(cells)
    return 0, 0


def _names(lines: Iterable[str], separator: str | None, width: int) -> list[str]:
    """Return names from the last line above the numbers that has as many, or numbers from 0."""
    names = [str(index) for index in range(width)]
    for line in lines:
        cells = [cell for cell in _cells(line.lstrip("# "), separator) if cell]
        if len(cells) == width == len(set(cells)):
            names = cells
    return names
