"""Lines behind a stamp, as Arduino's monitor writes what a microcontroller prints: ``10:00:00.123 -> 1.5,0.2``."""

from __future__ import annotations

import re

_STAMP = r"\d{2}:\d{2}:\d{2}\.\d{3} -> "
START = re.compile(rf"(?:[^\n]{{0,200}}\n){{0,5}}?{_STAMP}\s*[+-]?[.\d]")
"""How such a text begins, behind few other lines."""

_STAMPS = re.compile(f"^({_STAMP})", re.MULTILINE)

_LOOKED_AT = 1 << 12
"""Characters that show what separates numbers."""


def plain_text(text: str) -> str:
    """Return a text in columns: what separates its numbers stands behind each stamp too, and names have one for the times."""
    bare = _STAMPS.sub("", text[:_LOOKED_AT])
    between = next((sign for sign in ("\t", ";", ",") if sign in bare), " ")
    lines = text.split("\n")
    for place, line in enumerate(lines):
        words = _STAMPS.sub("", line)
        if words.strip() and not any(cell.strip().lstrip("+-.")[:1].isdigit() for cell in words.split(between)):
            lines[place] = f"time{between}{words}" if between in words else line
            continue
        lines[place] = line.replace(" -> ", between, 1) if _STAMPS.match(line) else line
    return "\n".join(lines)
