"""Files that ``tvident demo`` wrote itself: the only ones that it replaces."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

from tvident._files import check_folder, listed, printable, replaced

_RECORD = ".tvident-demo.json"
"""Beside the files: their names and what each held when it was written."""


def check_own(folder: Path, names: Iterable[str]) -> None:
    """Check that files of these names are missing, or as they were written.

    Raises
    ------
    ValueError
        If one of them was made or changed by somebody else.
    """
    written = _written(folder)
    places = {name: folder / name for name in names}
    foreign = [
        name
        for name, place in places.items()
        if place.is_symlink() or (place.exists() and (not place.is_file() or written.get(name) != _digest(place)))
    ]
    if foreign:
        raise ValueError(
            f"demo replaces only files that it wrote itself and nobody changed since; {printable(folder)} holds "
            f"{listed(foreign)} of somebody else; give another --folder, or move these away"
        )
    for place in (*places.values(), folder / _RECORD):
        check_folder(place)


def note_own(folder: Path, name: str) -> None:
    """Keep what a file that was just written holds."""
    content = _written(folder) | {name: _digest(folder / name)}
    with replaced(folder / _RECORD) as file:
        file.write((json.dumps(content, indent=1) + "\n").encode())


def _digest(place: Path) -> str:
    with place.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _written(folder: Path) -> dict[str, str]:
    """Return what the record says, an empty dictionary if it is no record."""
    try:
        content = json.loads((folder / _RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}
