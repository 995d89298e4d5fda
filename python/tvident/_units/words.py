"""Says position and force of a linear axis, in sentences that are written for an angle and a torque."""

from __future__ import annotations

import re
from collections.abc import Mapping

QUOTED = r"(?<!\w)(?:'(?:[^'\n]|(?<=\w)'(?=\w))*'|\"[^\"\n]*\")(?!\w)"
"""A pattern of what stands in quotes; an apostrophe within a word, as a genitive has it, is none of them."""

_WORD = re.compile(
    rf"(?P<kept>{QUOTED}|\w\([^()]*\))|(?P<article>\b[Aa]n )?(?<![\w.-])(?P<word>angle|torque)(?P<several>s?)\b(?![=_])",
    re.IGNORECASE,
)
"""A word that has another one; names of arguments, and what stands in quotes or in a call, are kept."""

_LINEAR = {"angle": ("m", "position"), "torque": ("N", "force")}
"""The unit of results by which each is known, and its word."""


def in_words_of(units: Mapping[str, str], text: str) -> str:
    """Return sentences with the words of an axis.

    Parameters
    ----------
    units : mapping of str to str
        Units of results.
    text : str

    Returns
    -------
    str
        Where angles are in m and torques in N, positions and forces.
    """

    def said(found: re.Match[str]) -> str:
        if found["kept"]:
            return found[0]
        word = found["word"]
        unit, linear = _LINEAR[word.lower()]
        if units.get(word.lower()) != unit:
            return found[0]
        article = (found["article"] or "").replace("n ", " ")
        return f"{article}{linear if word.islower() else linear.capitalize()}{found['several']}"

    return _WORD.sub(said, text)
