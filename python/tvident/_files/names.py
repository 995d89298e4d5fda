"""Names from files and from users, as messages and lists may show them."""

from __future__ import annotations

from collections.abc import Iterable

_LONGEST = 120
"""Characters of a name that are shown."""

_MOST = 20
"""Names that a message lists."""


def printable(text: object, longest: int = _LONGEST) -> str:
    r"""Return text that no terminal obeys: control and invisible characters as ``\x1b``, the end of a long one left out."""
    plain = str(text)
    if len(plain) > longest:
        plain = f"{plain[: longest - 3]}..."
    if plain.isprintable():
        return plain
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode("ascii") for one in plain)


def listed(names: Iterable[str]) -> str:
    """Return names with commas between them; of many the first, and how many more there are."""
    every = list(names)
    more = f" and {len(every) - _MOST} more" if len(every) > _MOST else ""
    return ", ".join(printable(name, 60) for name in every[:_MOST]) + more
