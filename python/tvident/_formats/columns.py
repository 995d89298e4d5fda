"""Names and units of the columns of a matrix, as attributes of it, or of what it is in, say them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tvident._formats.told import Remark, cut
from tvident._units import rate_said

UNITS = ("unit", "units", "Unit", "Units", "UNITS")
"""Attributes that hold a unit, or one for every column."""

COLUMNS = re.compile(
    r"(col|column|chan|channel|signal|var|variable)?_?(names?|labels?|headers?|titles?)|channels|signals|columns"
)
"""What a list of the columns of a matrix beside it is called, as ``importdata`` has it in ``colheaders``."""

_RATES = re.compile(
    r"[fF]s|(?i:(sampl(e|ing)|acquisition|scan)[ _-]?(rate|freq(uency)?)([ _-]?[([]?(in[ _-]?)?hz[)\]]?)?)"
)
"""What attributes are called that hold a sample rate."""

_SHOWN = 5
"""Rates that are listed at most."""

_WORD = re.compile(r"name|label|header|title")
"""What is about the whole where it is a text: a list of these has the name of each column."""

_BETWEEN = re.compile(r"[,;|\t\n]")


def channels_of(name: str, array: Any, attributes: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, Any]]:
    """Give an array, or the columns of a matrix, by names with units; attributes are its own, then those of what it is in."""
    unit = next((one for each in attributes[:2] if (one := first_of(each, UNITS)) is not None), None)
    if sum(length > 1 for length in array.shape) != 2:  # noqa: PLR2004 - rows and columns
        yield _named(name, unit), array
        return
    matrix = array.reshape([length for length in array.shape if length > 1])
    # A list that has the name of the matrix itself is one of what lies beside it.
    own = name.rpartition(".")[2]
    lists = ((_list_in(each, matrix.shape), each) for each in attributes)
    names, beside = next(((one, each) for one, each in lists if one and own not in one), ([], {}))
    count = len(names) or min(matrix.shape)
    units = _words(unit)
    # Units of the columns stand where their names do.
    if unit is None and len(of_names := _words(first_of(beside, UNITS))) == count:
        units = of_names
    if not names and not isinstance(unit, str) and len(units) != count:
        yield name, array
        return
    columns = matrix.T if matrix.shape[-1] == count else matrix
    of_columns = units if len(units) == count else [unit if isinstance(unit, str) else ""] * count
    for place, samples in enumerate(columns):
        column = names[place] if names else str(place)
        yield _named(f"{name}.{column}" if name else column, of_columns[place]), samples


def columns_of(name: str, array: Any, attributes: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names, with units, of the columns of an array that is not read, or its own where nothing names or numbers these."""
    import numpy as np  # noqa: PLC0415 - within the limits

    return [called for called, _ in channels_of(name, np.broadcast_to(np.zeros(()), array.shape), attributes)]


def first_of(attributes: Mapping[str, Any], names: Sequence[str]) -> Any:
    """Return the first of these attributes that is there, as text, a number, or an array."""
    for name in names:
        if name in attributes:
            value = attributes[name]
            value = value.item() if hasattr(value, "item") and value.size == 1 else value
            return value.decode(errors="replace") if isinstance(value, bytes) else value
    return None


def rate_in(whole: Mapping[str, Any], parts: Sequence[Mapping[str, Any]], skipped: list[str]) -> float | None:
    """Return the samples per second that the attributes of a file hold, or else all of its parts that hold one.

    None where there are none, where they differ, or where one is no number; both is said.
    """
    of_whole, of_parts = ([one for one in map(_rate, some) if one is not None] for some in ([whole], parts))
    said = of_whole or of_parts
    rates = dict.fromkeys(one if isinstance(one, float) else None for one in said)
    if None in rates:
        words = next(one for one in said if not isinstance(one, float))
        skipped.append(Remark(f"the sample rate of the file is no number: {cut(str(words))}; it is not read"))
        return None
    if len(rates) > 1:
        shown = ", ".join(f"{one:g}" for one in list(rates)[:_SHOWN])
        skipped.append(
            Remark(f"channels have several sample rates in Hz: {shown}; none is read: give that of those you use")
        )
        return None
    return next(iter(rates), None)


def rate_channel(
    whole: Mapping[str, Any], parts: Sequence[Mapping[str, Any]], skipped: list[str]
) -> Iterator[tuple[str, Any]]:
    """Give the sample rate that the attributes of a file, or of its parts, hold, as a channel of one number."""
    import numpy as np  # noqa: PLC0415 - within the limits

    rate = rate_in(whole, parts, skipped)
    if rate is not None:
        yield "sample_rate [Hz]", np.float64(rate)


def _rate(attributes: Mapping[str, Any]) -> Any:
    """Return the samples per second that attributes hold, or what they say where that is no number; None where they say nothing."""
    said = first_of(attributes, [name for name in attributes if _RATES.fullmatch(str(name))])
    try:
        rate = rate_said(said) if isinstance(said, str) else None if said is None else float(said)
    except (TypeError, ValueError):
        return said
    return said if rate is None else rate


def _named(name: str, unit: Any) -> str:
    return f"{name} [{unit}]" if isinstance(unit, str) and unit and name else name


def _list_in(attributes: Mapping[str, Any], shape: Sequence[int]) -> list[str]:
    """Return the names of as many columns, or rows, as a matrix has; nothing where the attributes say none."""
    for key in attributes:
        if COLUMNS.fullmatch(str(key).lower()):
            value = first_of(attributes, [key])
            if isinstance(value, str) and _WORD.fullmatch(str(key).lower()):
                continue
            found = _words(value)
            if len(found) in shape and 1 < len(found) < max(shape) and all(found):
                return found
    return []


def _words(value: Any) -> list[str]:
    """Return the words of a list, or of a text that separates them; nothing where they are none."""
    if isinstance(value, str):
        return [one.strip() for one in _BETWEEN.split(value)]
    cells = value.reshape(-1).tolist() if hasattr(value, "reshape") else value
    if not isinstance(cells, list | tuple):
        return []
    plain = [one.decode(errors="replace") if isinstance(one, bytes) else one for one in cells]
    return [one.strip() for one in plain] if all(isinstance(one, str) for one in plain) else []
