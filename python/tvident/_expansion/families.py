"""Families of functions on the interval from 0 to 1: their values and derivatives, and which sizes they come in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.splines import spline_values
from tvident._expansion.wavelets import haar_values, scaling_values

Array: TypeAlias = npt.NDArray[np.float64]

Blocks: TypeAlias = npt.NDArray[np.int64]

Values: TypeAlias = Callable[[Array, int, int], Array]
"""Of places, a size and the order of a derivative: an array of shape (places, size)."""

LAGUERRE_LENGTH = 5.0
"""The interval in units of the argument of Laguerre functions, whose first has faded to a twelfth at its end."""

OPEN_PERIOD = 1.5
"""Period of harmonics over the interval where the curve need not end as it begins: longer ones are harder to tell from each other."""


def _no_cells(_: int) -> int:
    return 0


@dataclass(frozen=True)
class Family:
    """Functions on the interval from 0 to 1, as many as wanted.

    Parameters
    ----------
    values : callable
    sizes : callable
        Gives the sizes from the smallest on.
    smooth : int
        How many derivatives are continuous, of those that equations need.
    block : callable, optional
        Of places and a size: which function is one there, where all others are zero.
    cells : callable, optional
        Of a size: in how many parts of one length functions are constant; 0 where they are not.
    """

    values: Values
    sizes: Callable[[], Iterator[int]]
    smooth: int = 2
    block: Callable[[Array, int], Blocks] | None = None
    cells: Callable[[int], int] = _no_cells


def every(first: int = 1, step: int = 1) -> Iterator[int]:
    """Give sizes from the first on."""
    size = first
    while True:
        yield size
        size += step


def _doubled() -> Iterator[int]:
    size = 1
    while True:
        yield size
        size *= 2


def _chebyshev(places: Array, size: int, derivative: int) -> Array:
    """Return Chebyshev polynomials of the first kind."""
    change = np.polynomial.chebyshev.chebder(np.eye(size), derivative) if derivative else np.eye(size)
    return np.asarray(np.polynomial.chebyshev.chebvander(2 * places - 1, len(change) - 1) @ change * 2.0**derivative)


def _second_chebyshev(places: Array, size: int, derivative: int) -> Array:
    """Return Chebyshev polynomials of the second kind: U_k = T'_{k+1} / (k+1)."""
    first = _chebyshev(places, size + 1, derivative + 1)[:, 1:] / 2
    return np.asarray(first / np.arange(1, size + 1))


def _legendre(places: Array, size: int, derivative: int) -> Array:
    change = np.polynomial.legendre.legder(np.eye(size), derivative) if derivative else np.eye(size)
    return np.asarray(np.polynomial.legendre.legvander(2 * places - 1, len(change) - 1) @ change * 2.0**derivative)


def _laguerre(places: Array, size: int, derivative: int) -> Array:
    """Return Laguerre functions exp(-x/2) L_k(x); (exp(-x/2) L)′ = exp(-x/2) (L′ - L/2)."""
    change = np.eye(size)
    for _ in range(derivative):
        slope = np.zeros_like(change)
        slope[: max(1, size - 1)] = np.polynomial.laguerre.lagder(change)
        change = slope - change / 2
    x = LAGUERRE_LENGTH * places
    functions = np.polynomial.laguerre.lagvander(x, size - 1) @ change
    return np.asarray(np.exp(-x / 2)[:, np.newaxis] * functions * LAGUERRE_LENGTH**derivative)


def _fourier(places: Array, size: int, derivative: int) -> Array:
    """Return one, then cosine and sine of every harmonic of the interval."""
    number = np.arange(size)
    harmonic = 2 * np.pi * ((number + 1) // 2)
    # A sine is a cosine a quarter of a turn late, a derivative one that is early.
    phase = np.where(number % 2 == 1, 0.0, -np.pi / 2) + derivative * np.pi / 2
    phase[0] = 0.0
    values = np.cos(places[:, np.newaxis] * harmonic + phase) * harmonic**derivative
    return np.asarray(values)


def _open_fourier(places: Array, size: int, derivative: int) -> Array:
    """Return the same with a period that is longer than the interval, so that nothing is said of what joins its ends."""
    return np.asarray(_fourier(places / OPEN_PERIOD, size, derivative) / OPEN_PERIOD**derivative)


def _block_pulse(places: Array, size: int, derivative: int) -> Array:
    if derivative:
        raise ValueError("block pulses have no derivatives")
    return np.asarray((_block(places, size)[:, np.newaxis] == np.arange(size)).astype(np.float64))


def _block(places: Array, size: int) -> Blocks:
    """Return the block pulse that is one at each place."""
    return np.clip((places * size).astype(np.int64), 0, size - 1)


def _as_many(size: int) -> int:
    return size


def _of_haar(size: int) -> int:
    """Return the parts that the shortest steps divide the interval into."""
    return 1 << (size - 1).bit_length()


FAMILIES: dict[str, Family] = {
    "chebyshev": Family(_chebyshev, every),
    "chebyshev2": Family(_second_chebyshev, every),
    "legendre": Family(_legendre, every),
    "powers": Family(_legendre, every),
    "fourier": Family(_fourier, partial(every, 1, 2)),
    "laguerre": Family(_laguerre, every),
    "block_pulse": Family(_block_pulse, every, smooth=-1, block=_block, cells=_as_many),
    "haar": Family(haar_values, _doubled, smooth=-1, cells=_of_haar),
    **{
        f"db{order}": Family(partial(scaling_values, order), partial(every, 2 * order), smooth=0)
        for order in range(2, 6)
    },
}
"""By name; B-splines depend on a degree: :func:`family_of`."""


def family_of(name: str, degree: int, *, is_period: bool = True) -> Family:
    """Return a family by its name, B-splines of a degree, harmonics of the interval if it is a period."""
    if name == "bspline":
        return Family(partial(spline_values, degree), every, smooth=degree - 1)
    if name == "fourier" and not is_period:
        return replace(FAMILIES[name], values=_open_fourier)
    return FAMILIES[name]


def plain_family(family: Family) -> dict[str, Any] | None:
    """Return what a family is called, as JSON has it; None for functions of the user's own."""
    function, given = _function_of(family)
    if function is spline_values:
        return {"name": "bspline", "degree": int(given[0])}
    if function is _open_fourier:
        return {"name": "fourier", "is_period": False}
    return next(({"name": name} for name, one in FAMILIES.items() if _function_of(one) == (function, given)), None)


def _function_of(family: Family) -> tuple[Callable[..., Array], tuple[Any, ...]]:
    """Return the function of a family and what it is given first: copies of a family, as pickle makes them, have the same."""
    values = family.values
    return (values.func, values.args) if isinstance(values, partial) else (values, ())


def family_from(plain: Mapping[str, Any]) -> Family:
    """Return a family from JSON."""
    return family_of(plain["name"], plain.get("degree", 0), is_period=plain.get("is_period", True))
