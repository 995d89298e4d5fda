"""One number for a parameter, with its error, of whatever kind it is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._arguments import percentiles, to_digits_of, with_error

Array = npt.NDArray[np.float64]

_RANGE = (5, 95)
"""Percent of the samples below either end of what is called the range."""


class Measured(NamedTuple):
    """A parameter of one record: ``value, error, *_ = result.value("inertia")``.

    Attributes
    ----------
    value, stderr : float
        Of a constant; 0 is the error of what was known. Of a parameter that changes the median of its values and of their errors.
    unit : str
    kind : str
        ``"constant"``, ``"windowed"``, ``"varying"``, ``"expanded"`` or ``"known"``.
    least, greatest : float
        Between them are nine tenths of the values.
    """

    value: float
    stderr: float
    unit: str
    kind: str
    least: float
    greatest: float

    @property
    def changes(self) -> bool:
        """Whether there is more than one value."""
        return self.least < self.greatest

    def __repr__(self) -> str:
        return f"<{self.kind}: {self}>"

    def __str__(self) -> str:
        words = with_error(self.value, self.stderr)
        if self.changes:
            ends = (to_digits_of(end, self.stderr) for end in (self.least, self.greatest))
            words = f"{' to '.join(ends)}, median {words}"
        return words if self.unit == "1" else f"{words} {self.unit}".rstrip()


def number_of(values: Array, errors: Array, kind: str, unit: str, where: npt.NDArray[np.bool_]) -> Measured:
    """Return one number for the values of a record, of those that can be trusted if there are some."""
    there = np.isfinite(values) & np.isfinite(errors)
    some = there & where if (there & where).any() else there
    if not some.any():
        return Measured(np.nan, np.nan, unit, kind, np.nan, np.nan)
    value, *ends = percentiles(values[some], 50, *_RANGE)
    (error,) = percentiles(errors[some], 50)
    least, greatest = ends if kind != "constant" else (value, value)
    return Measured(value, error, unit, kind, least, greatest)


def known_name(name: str, known: Iterable[str]) -> str:
    """Return a name that there is a value of.

    Raises
    ------
    KeyError
        If there is none.
    """
    names = list(known)
    if not isinstance(name, str) or name not in names:
        raise KeyError(f"there is no {arguments.shown(name)}; there are {', '.join(names)}")
    return name
