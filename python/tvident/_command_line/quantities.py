"""Options that are numbers with a unit."""

from __future__ import annotations

from typing import Any

import click

_PREFIXES = {"": 1.0, "k": 1e3, "M": 1e6}


class Quantity(click.ParamType[float]):
    """A number, with or without its unit behind it.

    Parameters
    ----------
    unit : str
        Of the number that is passed on; empty where another option says it.
    prefixes : str
        That may stand before the unit, of one letter.
    example : str
        What messages show.
    """

    name = "float"

    def __init__(self, unit: str, prefixes: str, example: str) -> None:
        self._factors = {"": 1.0} | {one + unit: _PREFIXES[one] for one in ("", *prefixes)}
        self._example = example

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number in the unit."""
        text = str(value).strip()
        number = text.rstrip("".join(self._factors)).rstrip()
        factor = self._factors.get(text[len(number) :].strip())
        try:
            return float(number if factor is not None else text) * (factor or 1.0)
        except ValueError:
            comma = "; the decimal sign is a point" if "," in text else ""
            self.fail(f"{text!r} is no number that is known; write {self._example}{comma}.", param, ctx)


RATE = Quantity("Hz", "kM", "500 or '0.5 kHz'")
PERIOD_IN_TIME_UNIT = Quantity("", "", "0.002, in seconds or the unit of --time-unit")
