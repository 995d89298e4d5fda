"""Settings beside a table: columns that everybody reads have no place for them, so a file of that name with more behind it keeps them."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tvident._files.channels import FileError, FileWarning
from tvident._files.names import printable
from tvident._files.places import writes_through
from tvident._files.replacement import replaced

_ENDING, _LONGEST_NAME = ".settings.json", 255
"""What stands behind the name of the table, and the bytes that a name may have."""

_DAMAGES = (ValueError, TypeError, KeyError, RecursionError)
"""What is raised where a file holds something else than settings."""


def place_beside(path: Path) -> Path | None:
    """Return where settings of a table stand; nowhere beside pipes and devices."""
    name = path.name + _ENDING
    if path.name in {"", "-"} or writes_through(path) or len(name.encode(errors="surrogateescape")) > _LONGEST_NAME:
        return None
    return path.with_name(name)


def check_beside(path: Path) -> None:
    """Check, before a table is written, that its settings replace nothing but settings.

    Raises
    ------
    FileError
        If what has their name is something else.
    """
    place = place_beside(path)
    if place is None or not place.exists():
        return
    try:
        holds_settings = place.is_file() and bool(_content(place))
    except _DAMAGES:
        holds_settings = False
    if not holds_settings:
        raise FileError(
            f"{printable(place)}: settings of {printable(path.name)} stand in a file of this name, and this one holds none; move it away, "
            "or write elsewhere"
        )


def write_settings(path: Path, settings: Mapping[str, Any]) -> None:
    """Keep the settings of a table that was just written, and what it held, to know it again."""
    place = place_beside(path)
    if place is None:
        return
    content = {"table": path.name, "sha256": _digest(path), "settings": settings}
    with replaced(place) as file:
        file.write((json.dumps(content, indent=1) + "\n").encode())


def settings_beside(path: Path) -> dict[str, Any]:
    """Return the settings that stand beside a table, or in such a file itself.

    Raises
    ------
    FileError
        If there are none, or they are damaged.

    Warns
    -----
    FileWarning
        If the table was changed since.
    """
    place = path if path.name.endswith(_ENDING) else place_beside(path)
    if place is None or not place.is_file():
        raise FileError(
            f"{printable(path)}: its settings stand in '{printable(path.name + _ENDING)}' beside it; there is no such file; copy it there, "
            "or give a result in .npz or .parquet, which holds its own"
        )
    try:
        name, digest, settings = _content(place)
        table = path.with_name(name)
    except _DAMAGES as error:
        raise FileError(
            f"{printable(place)}: must hold settings as they stand beside results; it does not ({printable(error, 80)}); copy it again"
        ) from None
    if place != path and _digest(path) != digest:
        warnings.warn(
            f"{printable(path)}: was changed after its settings were written beside it; they are those of the run that wrote "
            f"{printable(table.name)}",
            FileWarning,
            stacklevel=3,
        )
    return settings


def _content(place: Path) -> tuple[str, str, dict[str, Any]]:
    """Return the name of a table, what it held, and its settings; raise one of ``_DAMAGES`` where a file does not hold these."""
    content = json.loads(place.read_text(encoding="utf-8"))
    return content["table"], content["sha256"], dict(content["settings"])


def _digest(path: Path) -> str:
    import hashlib  # noqa: PLC0415 - the library loads without

    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
