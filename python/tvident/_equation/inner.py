"""Inner parameters of terms: numbers inside a term's function that are found by a search."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvident import _arguments as arguments

_MOST = 3
"""Inner parameters of one term: each is searched for on its own, so many depend too much on each other."""

_CERTAIN = 6.0
"""The error function is one to the last digit beyond."""


@dataclass(frozen=True)
class InnerParameter:
    """An inner parameter of a term.

    Parameters
    ----------
    term : str
        Name of the term.
    name : str
        Keyword of the term's function.
    limits : (float, float) or None
        Range to search; None where the record's velocity gives it.
    unit : str
        Of its value, empty if that is the user's.
    """

    term: str
    name: str
    limits: tuple[float, float] | None
    unit: str = ""

    @property
    def full_name(self) -> str:
        """What results call it."""
        return f"{self.term}.{self.name}"


def ranges(term: str, function: Callable[..., Any], search: object) -> dict[str, tuple[float, float]]:
    """Return the ranges of a term's inner parameters, checked.

    Raises
    ------
    TypeError
        If they are no mapping of words to pairs, or the function does not take them.
    ValueError
        If a range is empty, or there are too many.
    """
    of_term = f"search= of term {term!r}"
    if not isinstance(search, Mapping):
        raise TypeError(
            f"{of_term} must be a mapping of names to ranges; got {arguments.shown(search)}; write {{'delay': (0.02, 0.08)}}"
        )
    if len(search) > _MOST:
        raise ValueError(f"{of_term} may name {_MOST} inner parameters; got {len(search)}; give the others as known")
    found = {}
    for name, limits in search.items():
        if not isinstance(name, str) or not name.isidentifier():
            raise TypeError(
                f"{of_term} must name arguments of the function; got {arguments.shown(name)}; write {{'delay': (0.02, 0.08)}}"
            )
        if not isinstance(limits, tuple | list) or len(limits) != 2:  # noqa: PLR2004 - both ends
            raise TypeError(
                f"the range of {name!r} in {of_term} must be a pair; got {arguments.shown(limits)}; write (0.02, 0.08)"
            )
        low, high = (arguments.finite_number(f"the range of {name!r} in {of_term}", one) for one in limits)
        if not low < high:
            raise ValueError(f"the range of {name!r} in {of_term} must go upwards; got {low:g} to {high:g}; swap them")
        found[name] = (low, high)
    try:
        inspect.signature(function).bind(None, None, None, **dict.fromkeys(found))
    except TypeError as error:
        raise TypeError(
            f"the function of term {term!r} must take its inner parameters by name; got {', '.join(found)} ({error}); "
            f"write def f(t, angle, velocity, {', '.join(found) or 'delay'})"
        ) from None
    except ValueError:
        pass  # functions written in C may have no signature to look at
    return found


def expected_stribeck(velocity: Any, errors: Any, scale: float) -> Any:
    r"""Return what exp(-(v/v_s)²) sign(v) is on average where the velocity is known with a normal error; NaN where the velocity is.

    The product of the normal density and of the exponential is another normal density, whose sign is known.

    Parameters
    ----------
    velocity, errors : ndarray, shape (n,)
        Velocity in rad/s and its standard error.
    scale : float
        The Stribeck velocity in rad/s; infinite for the sign alone.
    """
    with np.errstate(all="ignore"):
        faded = 1 / (1 + 2 * (errors / scale) ** 2)
        left = np.sqrt(faded) * np.exp(-faded * (velocity / scale) ** 2)
        certain = np.abs(velocity) * np.sqrt(faded) / (errors * np.sqrt(2.0))
    sign = np.sign(velocity)
    near = np.flatnonzero(certain < _CERTAIN)
    sign[near] *= [math.erf(one) for one in certain[near].tolist()]
    return left * sign
