"""What users say of an expansion: the family of functions, how many, and of what."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._expansion.families import FAMILIES, Family, every, family_of

Own: TypeAlias = Callable[[npt.NDArray[np.float64], int], npt.ArrayLike]

InertiaTimes: TypeAlias = Literal["acceleration", "momentum"]

LARGEST = 64
"""Sizes that are tried at most where the record chooses."""

_MOST = 1024
"""Functions: a record's equations are solved in a second or two for so many, and for four times as many in half a minute."""

_NAMES = ("bspline", *FAMILIES)
_DEGREES = (1, 5)
_SHOWN = 6
_TWO = 2


@arguments.called_as("Expansion('bspline', of=position)")
@dataclass(frozen=True)
class Expansion:
    """A parameter as a sum of given functions with unknown factors: of time, or of a recorded channel.

    Takes the place of a kind: ``identify(…, stiffness=Expansion("bspline", of=position))``.

    Parameters
    ----------
    family : str, callable, or a pair of them
        ``"bspline"``, ``"chebyshev"`` (first kind), ``"chebyshev2"`` (second), ``"legendre"``, ``"powers"`` (computed with
        Legendre polynomials, which keep their digits), ``"fourier"`` (size 1, 3, 5…: a constant, then cosine and sine of every
        harmonic), ``"laguerre"``, ``"block_pulse"``, ``"haar"`` (size 1, 2, 4…), Daubechies' ``"db2"`` to ``"db5"`` (of
        so many vanishing moments); or a function ``f(x, size)`` of values of the channel, shape (m,), which returns shape (m, size). A pair
        belongs to the two channels of `of`.
    size : "auto", int, or a pair of them
        How many functions, at most 1024. ``"auto"``: that with the lowest corrected Akaike criterion, in which overlapping equations
        count as often as they tell something new; ``result.expansions["stiffness"].sizes`` is the table of all that were tried. A curve
        of time is the mean over those that explain the record nearly as well.
    of : array_like, shape (n,), or a pair of them, optional
        The recorded channel that the parameter is a function of, such as a position; by default time. Of two channels: all products of
        the functions of each. Its noise counts as part of the curve. Trials share it. Equations that touch a missing value are left
        out.
    limits : (float, float), or a pair of them, optional
        The range of the channel that functions live on, in its unit; by default from its smallest value to its largest. For
        ``"fourier"`` limits that are given are a period: one turn of an angle. By default the period is half as long again as the
        range, so that the curve need not end as it begins.
    degree : int, optional
        Of B-splines, 1 to 5.
    inertia_times : {"acceleration", "momentum"}, optional
        What an expanded inertia stands for: ``"acceleration"``, I θ̈, is the equation of motion (1) as it is for all other kinds.
        ``"momentum"``, d(I θ̇)/dt = I θ̈ + İ θ̇, is Newton's law where mass moves with the angle and leaves with its momentum.
    largest : int, optional
        The largest size that is tried, at most 1024; of two channels the most functions in all.

    Raises
    ------
    ValueError
        If a family is unknown, a size does not exist in it, or limits are no range.
    TypeError
        If something is of the wrong type.

    Notes
    -----
    Damping and inertia are integrated by parts with their functions: ⟨φ C θ̇⟩ = -⟨φ′ Cθ⟩ - ⟨φ Ċθ⟩ and ⟨φ I θ̈⟩ = ⟨φ″ Iθ⟩ + 2⟨φ′ İθ⟩ +
    ⟨φ Ïθ⟩, so these functions must have continuous derivatives: block pulses and Haar functions serve for stiffness and terms. The rate
    of a channel comes from :func:`tvident.fit_local_polynomials`.

    See Also
    --------
    identify : takes it as ``inertia=``, ``damping=``, ``stiffness=`` or as the kind of a term.

    References
    ----------
    C. de Boor: A practical guide to splines, Springer 1978.
    I. Daubechies: Orthonormal bases of compactly supported wavelets, CPAM 41 (1988).

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=8.0)
    >>> spring = tvident.Expansion("bspline", of=rig.slider_position)
    >>> result = tvident.identify(
    ...     rig.angle, rig.torque, sample_rate=1000, inertia="constant", damping="constant", stiffness=spring
    ... )
    >>> curve = result.expansions["stiffness"]
    >>> bool(abs(curve.at(0.45) / (6 / 0.45) - 1).max() < 0.01)
    True
    """

    family: str | Own | Sequence[Any]
    size: Literal["auto"] | int | Sequence[Any] = "auto"
    of: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None
    limits: Sequence[Any] | None = None
    degree: int = 3
    inertia_times: InertiaTimes = "acceleration"
    largest: int = LARGEST

    def __post_init__(self) -> None:
        arguments.whole_number("degree", self.degree, least=_DEGREES[0])
        if self.degree > _DEGREES[1]:
            raise ValueError(f"degree must be at most {_DEGREES[1]}; got {self.degree}; take 3")
        arguments.one_of("inertia_times", self.inertia_times, get_args(InertiaTimes))
        arguments.whole_number("largest", self.largest, least=1, most=_MOST)
        if math.prod(one or 1 for one in self.given_sizes) > _MOST:
            raise ValueError(
                f"size must be at most {_MOST} functions in all; got {' x '.join(map(str, self.given_sizes))}; a curve of fewer shows "
                "all that a record holds"
            )
        if isinstance(self.family, tuple | list) and len(self.family) != self.dimensions:
            raise ValueError(
                f"a pair of families belongs to two channels; got {len(self.family)} families and {self.dimensions} channels; "
                "give of=(one, other)"
            )
        for family, size in zip(self.families, self.given_sizes, strict=True):
            if size is not None:
                last = next(one for one in family.sizes() if one >= size)
                if last != size:
                    some = ", ".join(str(one) for one in islice(family.sizes(), _SHOWN))
                    raise ValueError(f"size must be one of {some}…; got {size}; take {last}")
        _ = self.given_limits

    @property
    def is_of_time(self) -> bool:
        """True where it is a function of time, False of a channel.

        See Also
        --------
        channels : what it is a function of.
        """
        return self.of is None

    @property
    def channels(self) -> tuple[npt.NDArray[np.float64], ...]:
        """The channels that it is a function of, as a tuple of arrays, shape (n,); empty where it is one of time.

        See Also
        --------
        is_of_time : whether it is a function of time.
        """
        if self.of is None:
            return ()
        pair = isinstance(self.of, tuple | list) and len(self.of) == _TWO and np.ndim(self.of[0]) > 0
        each: Sequence[Any] = self.of if pair else [self.of]  # type: ignore[assignment] # a pair
        return tuple(np.asarray(arguments.channel("of", one), dtype=np.float64) for one in each)

    @property
    def dimensions(self) -> int:
        """How many coordinates there are: 1 or 2.

        See Also
        --------
        channels : what they are.
        """
        return max(1, len(self.channels))

    @property
    def families(self) -> tuple[Family, ...]:
        """The functions of every coordinate, of places from 0 to 1, as a tuple.

        See Also
        --------
        families_within : the same between limits.
        """
        return self.families_within([(0.0, 1.0)] * self.dimensions)

    def families_within(self, limits: Sequence[tuple[float, float]]) -> tuple[Family, ...]:
        """Return the functions of every coordinate; those of the user's own take values between these limits.

        Parameters
        ----------
        limits : sequence of (float, float)
            Of every coordinate.

        Returns
        -------
        tuple of Family

        See Also
        --------
        families : the same of places from 0 to 1.
        """
        each = self.family if isinstance(self.family, tuple | list) else [self.family] * self.dimensions
        return tuple(self._family(one, within) for one, within in zip(each, limits, strict=True))

    @property
    def given_sizes(self) -> tuple[int | None, ...]:
        """The size of every coordinate, as a tuple of int; None where the record chooses.

        See Also
        --------
        given_limits : the ranges.
        ExpandedParameter.size : what was chosen.
        """
        several = isinstance(self.size, tuple | list) or _several(self.size)
        each: Sequence[Any] = self.size if several else [self.size] * self.dimensions  # type: ignore[assignment] # several
        if len(each) != self.dimensions:
            raise ValueError(
                f"size must be one number for each of {self.dimensions} coordinates; got {len(each)}; give one number for all"
            )
        return tuple(
            None if arguments.is_word(one, "auto") else arguments.whole_number("size", one, least=1, most=_MOST)
            for one in each
        )

    @property
    def given_limits(self) -> tuple[tuple[float, float] | None, ...]:
        """The range of every coordinate in the channel's unit, or in seconds, where it was given.

        See Also
        --------
        given_sizes : the sizes.
        """
        if self.limits is None:
            return (None,) * self.dimensions
        several = _several(self.limits)
        each: Sequence[Any] = self.limits if several and _several(self.limits[0]) else [self.limits] * self.dimensions
        if len(each) != self.dimensions or not all(_several(one) and len(one) == _TWO for one in each):
            raise ValueError(
                f"limits must be a pair of numbers, or one pair for each of {self.dimensions} coordinates; got "
                f"{arguments.shown(self.limits)}; write (0, 1), say"
            )
        found = []
        for one in each:
            low, high = (arguments.finite_number("limits", end) for end in one)
            if not low < high:
                raise ValueError(
                    f"limits must be a range, the lower end first; got {low:g} and {high:g}; exchange them"
                )
            found.append((low, high))
        return tuple(found)

    @property
    def called(self) -> str:
        """What it is called in a sentence.

        See Also
        --------
        channels : what it is a function of.
        """
        names = self.family if isinstance(self.family, tuple | list) else [self.family]
        return " x ".join(one if isinstance(one, str) else getattr(one, "__name__", "own") for one in names)

    @property
    def is_of_powers(self) -> bool:
        """True where the functions are powers of the channel: the family ``"powers"``.

        See Also
        --------
        families : the functions.
        """
        return self.family == "powers"

    def _family(self, one: Any, limits: tuple[float, float]) -> Family:
        if callable(one):
            return Family(partial(_own_values, one, limits), every)
        return family_of(arguments.one_of("family", one, _NAMES), self.degree, is_period=self.limits is not None)


def _several(given: Any) -> bool:
    """Return whether there is something in what was given."""
    return bool(isinstance(given, tuple | list) and given) or bool(
        isinstance(given, np.ndarray) and given.ndim and given.size
    )


_STEP = 1e-3
"""Part of the range by which a function of the user's own is moved to find its derivatives."""


def _own_values(
    function: Own, limits: tuple[float, float], places: npt.NDArray[np.float64], size: int, derivative: int
) -> npt.NDArray[np.float64]:
    """Return functions of the user's own; derivatives by differences of fourth order, whose error is the step to the fourth power."""

    def at(where: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        found = np.asarray(function(limits[0] + (limits[1] - limits[0]) * where, size), dtype=np.float64)
        if found.shape != (where.size, size):
            raise ValueError(
                f"a family of your own must return an array of shape {(where.size, size)}; got {found.shape}; "
                "return one column for each function"
            )
        return found

    if derivative == 0:
        return at(places)
    far, near = (at(places + _STEP * k) for k in (2, 1))
    back, further = (at(places - _STEP * k) for k in (1, 2))
    if derivative == 1:
        return np.asarray((8 * (near - back) - (far - further)) / (12 * _STEP))
    return np.asarray((16 * (near + back) - (far + further) - 30 * at(places)) / (12 * _STEP**2))
