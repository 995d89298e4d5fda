"""A unit as a header writes it: ``N·m``, ``Nmm``, ``in-lb``, ``deg/s``, ``kg m^2``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from tvident._units.symbols import (
    ALONE_IN_CAPITALS,
    DOUBTFUL,
    IN_CAPITALS,
    LONGEST,
    NEVER_JOINED,
    NONE,
    ROTATIONS,
    SYMBOLS,
    Dimension,
)

_LONGEST_TEXT = 60

_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")
_SAME = str.maketrans(
    {
        "µ": "u",
        "μ": "u",
        "·": " ",
        "⋅": " ",
        "∙": " ",
        "•": " ",
        "\u30fb": " ",
        "\uff65": " ",
        "\u00d7": " ",
        "*": " ",
        "º": "°",
        "˚": "°",
    }
    | dict.fromkeys("\u2010\u2011\u2012\u2013\u2212", "-")
)

_WORD = re.compile(r"[A-Za-z]+")
_FACTOR = re.compile(r"([A-Za-z°%]+)(?:\^?\(?([+-]?[1-9])\)?)?")
_POWER = re.compile(r"\s*\^\s*")
_ONE_OVER = re.compile(r"1\s*/\s*")
_BETWEEN = re.compile(r"\s*([/.]|-(?=[A-Za-z]))?\s*")

_BRACKETS = {"[": "]", "(": ")", "{": "}", "<": ">"}
_DEGREES = frozenset(("grados", "graden", "gradi", "grader", "graus"))
"""What degrees are called where nobody calls gon so."""

_NO_UNIT = frozenset(("", "-", "--", "1", "none", "n/a", "a.u.", "[]", "()"))


@dataclass(frozen=True)
class Unit:
    """A unit: its factor to kg, m, s and rad, and the powers of these."""

    factor: float
    dimension: Dimension


def is_unit(text: str) -> bool:
    """Return whether a cell of a header can be a unit, or says that there is none."""
    bare = without_brackets(text)
    return bare.lower() in _NO_UNIT or bare in DOUBTFUL or unit_of(bare) is not None


def without_brackets(text: str) -> str:
    """Return a unit without brackets around it; those within stay: Degree(s), Nm/(rad/s)."""
    bare = text.strip()
    while bare[:1] in _BRACKETS and bare.endswith(_BRACKETS[bare[:1]]):
        bare = bare[1:-1].strip()
    # What is open at one end is a bracket that nobody closed.
    return bare.strip("[](){}<>").strip() if bare.count("(") != bare.count(")") else bare.strip("[]{}<>").strip()


@lru_cache(maxsize=256)
def unit_of(text: str) -> Unit | None:
    """Return the unit that a text stands for, or None where it is none that is known."""
    if len(text) > _LONGEST_TEXT:
        return None
    raised = _RAISED.sub(lambda found: "^" + found[0].translate(_SUPERSCRIPTS), text)
    plain = raised.replace("**", "^").translate(_SAME).strip().strip("[]{}<>").strip()
    if plain.startswith("(") and plain.endswith(")"):
        plain = plain[1:-1].strip()
    plain = _POWER.sub("^", plain.removesuffix(".").removesuffix("(s)"))
    if plain in DOUBTFUL:
        return None  # asked for
    if plain.lower() in _DEGREES:
        return _product("deg")
    if "grad" in plain.lower():
        return None  # degrees in German, gon in French, and no gram
    speed = ROTATIONS.get(plain.lower().replace(".", ""))
    if speed is not None:
        return Unit(*speed)
    exact = _product(plain)
    return _product(_in_usual_letters(plain)) if exact is None else exact


def _in_usual_letters(text: str) -> str:
    """Return a unit as it is written usually, where another program wrote DEG, Sec or FT-LBS."""
    known = IN_CAPITALS if len(_WORD.findall(text)) > 1 else ALONE_IN_CAPITALS
    return _WORD.sub(lambda found: found[0] if found[0] in DOUBTFUL else known.get(found[0].lower(), found[0]), text)


def _product(text: str) -> Unit | None:
    """Read factors from left to right; what stands in brackets behind a slash divides as a whole."""
    factor, dimension, place, sign = 1.0, NONE, 0, 1
    one_over = _ONE_OVER.match(text)
    if one_over is not None:
        place, sign = one_over.end(), -1
    while place < len(text):
        if text[place] == "(":
            end = text.find(")", place)
            inner = _product(text[place + 1 : end]) if end > 0 else None
            if inner is None:
                return None
            place = end + 1
        else:
            found = _FACTOR.match(text, place)
            inner = None if found is None else _symbols(found[1], int(found[2] or 1))
            if found is None or inner is None:
                return None
            place = found.end()
        factor *= inner.factor**sign
        dimension = tuple(a + sign * b for a, b in zip(dimension, inner.dimension, strict=True))
        between = _BETWEEN.match(text, place)
        if between is None or (place < len(text) and between.end() == place and text[place] != "("):
            return None
        place, sign = between.end(), -1 if between[1] == "/" else 1
        if between[1] and place == len(text):
            return None
    return Unit(factor, dimension) if text else None


def _symbols(word: str, power: int) -> Unit | None:
    """Return one symbol, or several that are written without anything between: Nm, kgm2. The power is of the last."""
    if word in SYMBOLS:
        factor, dimension = SYMBOLS[word]
        return Unit(factor**power, tuple(power * one for one in dimension))
    for length in range(min(len(word) - 1, LONGEST), 0, -1):
        is_first = word[:length] in SYMBOLS and not NEVER_JOINED.intersection((word[:length], word[length:]))
        rest = _symbols(word[length:], power) if is_first else None
        if rest is not None:
            factor, dimension = SYMBOLS[word[:length]]
            return Unit(factor * rest.factor, tuple(a + b for a, b in zip(dimension, rest.dimension, strict=True)))
    return None
