"""Further terms of the equation of motion: built-in terms, and user-defined ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation.built_in import TERM_NAMES
from tvident._equation.kinds import Kind
from tvident._equation.names import name_of_term


@dataclass(frozen=True)
class Term:
    """A user-defined term on the left-hand side of the equation of motion, with an unknown factor.

    Parameters
    ----------
    name : str
        What the factor is called in results: a letter, then letters, digits, spaces, ``_``, ``-`` and ``.``; no name that results have
        already, such as ``"time"``.
    function : callable
        Function of ``(t, angle, velocity)``: times in s of shape (n,), smoothed angle in rad and velocity in rad/s of the angle's shape.
        They are copies, which the function may change. Returns an array of that shape. The unit of the factor is N m over that of the
        function.

    Raises
    ------
    ValueError
        If the name is taken or holds other signs.
    TypeError
        If the name is no word, or the function cannot be called.

    See Also
    --------
    identify : takes it in ``terms=``, beside the built-in ones.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Equation (1), to which terms are added.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> drag = tvident.Term("drag", lambda t, angle, velocity: velocity * np.abs(velocity))
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, inertia=0.0123, terms=[drag])
    >>> result.terms["drag"].shape
    (3000,)
    """

    name: str
    function: Callable[[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]], npt.ArrayLike]

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", str(name_of_term(self.name)))
        if not callable(self.function):
            raise TypeError(
                f"the function of term {self.name!r} must be callable; got {arguments.shown(self.function)}; "
                "pass a function of (t, angle, velocity)"
            )

    def values(
        self, t: npt.NDArray[Any], angle: npt.NDArray[Any], velocity: npt.NDArray[Any]
    ) -> npt.NDArray[np.number]:
        """Return the term at every sample, in the angle's shape.

        Raises
        ------
        ValueError
            If the function returns another shape.
        TypeError
            If it returns no real numbers.
        """
        # The result's time and the angle of the next term are not for this function to change.
        returned = self.function(t.copy(), angle.copy(), velocity.copy())
        values = arguments.any_array(f"what the function of term {self.name!r} returns", returned)
        if values.shape != angle.shape:
            raise ValueError(
                f"the function of term {self.name!r} must return an array of shape {angle.shape}; got {values.shape}; "
                "return one value for every sample"
            )
        return values


GivenTerm: TypeAlias = str | Term | tuple[str | Term, Kind]
"""The name of a built-in term, a term of one's own, or a pair of one of these and its kind."""


@dataclass(frozen=True)
class Unknown:
    """A column of the equations: its name, its kind and, for a term of the user's own, the term."""

    name: str
    kind: Kind
    own: Term | None = None


def all_terms(terms: Sequence[Any], default: Kind) -> list[Unknown]:
    """Return every further term with its name and kind."""
    if isinstance(terms, str | Term):
        shown = arguments.shown(terms)
        raise TypeError(f"terms must be a sequence of terms; got {shown}; write ({shown},)")
    if not isinstance(terms, Sequence):
        raise TypeError(f"terms must be a sequence of terms; got {arguments.shown(terms)}; write ('offset',), say")
    found: list[Unknown] = []
    for given in terms:
        pair = isinstance(given, tuple | list) and len(given) == 2  # noqa: PLR2004 - a term and its kind
        term, kind = given if pair else (given, default)
        arguments.one_of("the kind of a term", kind, ("windowed", "constant"))
        own = term if isinstance(term, Term) else None
        name = arguments.one_of("a term", term, TERM_NAMES) if own is None else own.name
        if any(name.casefold() == other.name.casefold() for other in found):
            raise ValueError(f"every term must have a name of its own; {name!r} comes twice; drop or rename one")
        found.append(Unknown(name, kind, own))
    return found
