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


def place_beside(path: Path) -> Path | None:
    """Return where settings of a table stand; nowhere beside pipes and devices."""
    name = path.name + _ENDING
    if path.name == "-" or writes_through(path) or len(name.encode(errors="surrogateescape")) > _LONGEST_NAME:
        return None
    return path.with_name(name)


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
        content = json.loads(place.read_text(encoding="utf-8"))
        table, digest, settings = path.with_name(content["table"]), content["sha256"], dict(content["settings"])
    except (ValueError, TypeError, KeyError, RecursionError) as error:
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


def _digest(path: Path) -> str:
    import hashlib  # noqa: PLC0415 - the library loads without

    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
