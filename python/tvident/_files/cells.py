"""Cells of a line of text, and the numbers that they hold."""

from __future__ import annotations

import csv
import math
import re

Separator = str | None
"""What stands between cells; None: blanks."""

_MINUS = re.compile("^[\N{MINUS SIGN}\N{EN DASH}](?=[\\d.,])|(?<=[eE])\N{MINUS SIGN}")
"""What word processors and some programs write for it."""

_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_FORTRAN = re.compile(r"([+-]?(?:\d+\.\d*|\.\d+))[dD]([+-]?\d{1,3})", re.ASCII)
"""Double precision as Fortran writes it."""

_JOINED = re.compile(r"[-+]?\d*\.\d*(?:[eEdD][-+]?\d+)?(?:[-+]\d*\.\d*(?:[eEdD][-+]?\d+)?)+", re.ASCII)
"""Numbers that fill their columns, as Fortran writes them."""

_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)
_GROUPS = re.compile(
    r"[+-]?[1-9]\d{0,2}(?:(?P<blank>[ '\u2019\u00a0\u2009\u202f])\d{3}(?:(?P=blank)\d{3})*(?P<behind>[.,]\d*)?"
    r"|(?:,\d{3})+(?P<point>\.\d*)|(?:\.\d{3})+(?P<comma>,\d*)|(?:,\d{3}){2,}|(?:\.\d{3}){2,})",
    re.ASCII,
)
"""Thousands are separated in groups of three; a single comma or point alone may be a decimal sign."""

_BLANKS = re.compile("[ '\u2019\u00a0\u2009\u202f]")

_ONE_GROUP = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", re.ASCII)
_INFINITE = re.compile(r"([+-]?)(inf|infinity|1[.,]#inf0*)", re.IGNORECASE)
_MISSING = re.compile(
    r"([+-]?nan(\((ind|snan)?\))?|n/?a|n\.a\.|<na>|-{1,3}|-{1,6}[.:]-{1,6}|\*{1,12}|#n/[ad]|#nv|\(?null\)?|none|nil"
    r"|[+-]?1[.,]#((qnan|snan|ind)0*|[jrqi]|qo|io|qn|in))?",
    re.IGNORECASE,
)
_NO_READING = re.compile(
    r"[+-]?(ovld|ovl|o\.?l\.?|over|over[ _-]?load(ed)?|over[ _-]?flow|over[ _-]?range|out[ _-]of[ _-]range|under|under[ _-]?flow"
    r"|under[ _-]?range|ovrng|open|no[ _-]?data|no[ _-]?value|invalid|missing|[?.])",
    re.IGNORECASE,
)
"""What instruments write in place of a number that they could not measure."""

_ERROR = (
    "#(?:n/a|n/d|nv|div/0|¡?(?:div/0|deel/0|дел/0|ref|bezug|rif|verw|ссылка|value|wert|valeur|valor|valore|waarde|arg|знач"
    "|num|zahl|nombre|getal|число|name|nom|nome|naam|имя|null|nul|nulo|leeg|пусто|calc|spill|field|überlauf)[!?])(?=\\s*(?:[\\t,;|\"']|$)|\\s+[-+.#\\d\"'])"
)
"""What spreadsheets write where a formula found no number, in some languages."""

_IS_ERROR = re.compile(_ERROR, re.IGNORECASE)
_NOT_AVAILABLE = re.compile("#(?:n/[ad]|nv)", re.IGNORECASE)
"""What a sheet writes on purpose, for a value that is missing."""

_NOT_A_COMMENT = re.compile(
    rf"{_ERROR}|(?<=1[.,])#(?:(?:qnan|snan|ind|inf)0*|[jrqi]|qo|io|qn|in)\b", re.IGNORECASE | re.MULTILINE
)
_BETWEEN_WORDS = re.compile(r"[,;|\s]+")
_IN_QUOTES = re.compile(r'"[^"]*"|[^\s"]+')


def split(line: str, separator: Separator) -> list[str]:
    """Return the cells of a line without blanks and quotes around them; a separator in double quotes is part of its cell."""
    if '"' not in line:
        cells = line.strip().split() if separator is None else line.strip("\r\n ").split(separator)
    elif separator is None:
        cells = _IN_QUOTES.findall(line)
    else:
        try:
            cells = next(csv.reader([line.strip("\r\n ")], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:  # a cell of more than 131 072 characters
            cells = line.split(separator)
    return [cell.strip().strip("\"'").strip() for cell in cells]


def without_comment(line: str) -> str:
    """Return a line up to its ``#``, unless this is how spreadsheets and older programs write that there is no number."""
    start = line.find("#")
    while start >= 0:
        if not _NOT_A_COMMENT.match(line, start):
            return line[:start]
        start = line.find("#", start + 1)
    return line


def is_comment(line: str) -> bool:
    """Return whether a line is nothing but a comment."""
    return line.lstrip().startswith("#") and not without_comment(line).strip()


def is_remark(line: str, *, least: int = 1) -> bool:
    """Return whether a line begins as an error of a spreadsheet does, and goes on with so many words and no number: a comment about it."""
    if not line.lstrip().startswith("#"):
        return False
    words = [word for word in _BETWEEN_WORDS.split(line.strip()) if number(word, comma=True) is None]
    are_numbers = any(is_present(word, comma=True) for word in _BETWEEN_WORDS.split(line.strip()))
    return len(words) >= least and not are_numbers


def hides_numbers(text: str) -> bool:
    """Return whether a ``#`` in a text is part of a cell rather than the beginning of a comment."""
    return "#" in text and _NOT_A_COMMENT.search(text) is not None


def says_no_number(cell: str) -> bool:
    """Return whether an instrument or a spreadsheet says in a cell that there is no number, and why."""
    return is_error(cell) or _NO_READING.fullmatch(cell) is not None


def is_error(cell: str) -> bool:
    """Return whether a spreadsheet says in a cell that a formula found no number."""
    return cell.startswith("#") and _IS_ERROR.fullmatch(cell) is not None and not _NOT_AVAILABLE.fullmatch(cell)


def fortran_as_usual(text: str) -> str:
    """Return text with ``e`` where Fortran writes a D between a number and its exponent."""
    return _FORTRAN.sub(r"\1e\2", text) if "D" in text or "d" in text else text


def number(cell: str, *, comma: bool, decimal: str | None = None) -> float | None:
    """Return the number in a cell, NaN where it says that there is none, None where it says anything else.

    ``comma`` allows a comma as the decimal sign; ``decimal`` says which sign it is, where that is known. A number too large for 64 bits is
    none.
    """
    if not cell:
        return math.nan
    if not cell.isascii():
        cell = _MINUS.sub("-", cell)
    plain = _plain(fortran_as_usual(cell), comma=comma, decimal=decimal)
    if plain is not None:
        value = float(plain)
        return value if math.isfinite(value) else None
    if _MISSING.fullmatch(cell) or says_no_number(cell):
        return math.nan
    infinite = _INFINITE.fullmatch(cell)
    return float(f"{infinite[1]}inf") if infinite else None


def _plain(cell: str, *, comma: bool, decimal: str | None) -> str | None:
    """Return a number with a point and nothing between its digits."""
    if decimal is not None and decimal not in cell and _ONE_GROUP.fullmatch(cell):
        return cell.replace(",", "").replace(".", "")
    if _POINT.fullmatch(cell):
        return None if decimal == "," and "." in cell else cell
    if comma and _COMMA.fullmatch(cell):
        return None if decimal == "." else cell.replace(",", ".")
    return _grouped(cell, decimal)


def _grouped(cell: str, decimal: str | None) -> str | None:
    """Return a number whose thousands are separated without what separates them, unless its decimal sign is another."""
    if not _GROUPS.fullmatch(cell):
        return None
    sign = decimal_sign(cell)
    if sign is not None and decimal not in {None, sign}:
        return None
    if sign is not None:
        cell = cell.replace("," if sign == "." else ".", "").replace(",", ".")
    return _BLANKS.sub("", cell)


def decimal_sign(cell: str) -> str | None:
    """Return the decimal sign that a number shows, "?" where it may as well separate thousands, None where nothing shows one."""
    if not ("." in cell or "," in cell):
        return None
    if _ONE_GROUP.fullmatch(cell):
        return "?"
    groups = _GROUPS.fullmatch(cell)
    if groups is None:
        return "," if "," in cell else "."
    behind = groups["behind"]
    if behind or groups["point"] or groups["comma"]:
        return behind[0] if behind else "." if groups["point"] else ","
    if groups["blank"]:
        return None
    return "." if "," in cell else ","


def are_joined(cell: str) -> bool:
    """Return whether nothing but the sign of the second stands between two numbers."""
    return _JOINED.fullmatch(cell) is not None


def is_present(cell: str, *, comma: bool) -> bool:
    """Return whether a cell holds a number, rather than nothing or words."""
    value = number(cell, comma=comma)
    return value is not None and not math.isnan(value)
