"""Text as rows of numbers: copied once, since nobody knows where a line begins before all others are read."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np

from tvident._files import FileError, FileWarning, copy_text, no_rate_stated, printable, stated_rate
from tvident._in_pieces.file_rows import ColumnOfRows, RowsOfFile
from tvident._in_pieces.recorded import check_same
from tvident._in_pieces.said import SaidOfRate
from tvident._in_pieces.sources import Source


def copied(path: Path, folder: Path, mark: str) -> Source:
    """Return the columns of a text, which are copied to a folder unless they are there.

    Raises
    ------
    FileError
        If the text cannot be read as it is meant, or is not what it was when the mark was taken: its last line may be a part of one.
    """
    rows, named = folder / "recording", folder / "recording.json"
    if not named.exists():
        said: list[str] = []
        try:
            with rows.open("wb") as file:
                found = copy_text(path, file, said.append)
        except FileError as error:
            raise FileError(f"{printable(path)}: cannot be read as text: {error}") from None
        check_same(path, mark)
        for message in said:
            warnings.warn(f"{printable(path)}: {message}", FileWarning, stacklevel=4)
        beside = folder / "recording.json.new"
        beside.write_text(json.dumps(found), encoding="utf-8")
        beside.replace(named)
    names: list[str | None] = json.loads(named.read_text(encoding="utf-8"))
    number = np.dtype(np.float64)
    samples = rows.stat().st_size // (number.itemsize * len(names))
    together = RowsOfFile(rows, 0, number, len(names))
    columns = {name: (ColumnOfRows(together, place), samples) for place, name in enumerate(names) if name is not None}
    stated = stated_rate(path)
    rate = SaidOfRate(None, wrong=no_rate_stated(path)) if stated is None else SaidOfRate(stated.rate, text=path)
    return Source(columns, lambda: None, printable(path), rate)
