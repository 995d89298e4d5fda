"""Further terms of the equation of motion: built-in terms, and user-defined ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._choices import BUILT_IN, OFFSET, TERM_NAMES, Kind
from tvident._equation.inner import InnerParameter, ranges
from tvident._equation.names import name_of_term
from tvident._expansion import Expansion


@arguments.called_as("Term('drag', lambda t, angle, velocity: velocity * abs(velocity))")
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
        function. With `search` it also takes the inner parameters, by name, and is called with single records of shape (n,).
    search : mapping of str to (float, float), optional
        Inner parameters, such as the delay of a reflex or the width of a backlash, and the range that each may lie in: at most three.
        They are constant over a record, and found by a search for the lowest criterion of :func:`tvident.compare_models`, at 17 values
        first. ``constants["name.delay"]`` holds the value and its standard error (delta method), which the errors of all other
        parameters know of. :func:`tvident.identify` then costs about 10 to 20 times as much; ``settings=`` of a result repeats it
        without a search. The summary says if the term is not needed, or if the best value is an end of the range.

    Raises
    ------
    ValueError
        If the name is taken or holds other signs, or a range is empty.
    TypeError
        If the name is no word, the function cannot be called, or it does not take what is searched.

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

    A reflex that answers the velocity of some time ago:

    >>> def reflex(t, angle, velocity, delay):
    ...     return np.interp(t - delay, t, velocity)
    >>> torque = rig.torque + 0.05 * reflex(rig.time, rig.true_angle, rig.true_velocity, delay=0.045)
    >>> term = tvident.Term("reflex", reflex, search={"delay": (0.02, 0.08)})
    >>> result = tvident.identify(rig.angle, torque, sample_rate=1000, inertia=0.0123, damping="constant", terms=[term])
    >>> delay, error = result.constants["reflex.delay"]
    >>> bool(abs(delay - 0.045) < 4 * error)
    True
    """

    name: str
    function: Callable[..., npt.ArrayLike]
    search: Mapping[str, tuple[float, float]] | None = field(default=None, hash=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", str(name_of_term(self.name)))
        if not callable(self.function):
            raise TypeError(
                f"the function of term {self.name!r} must be callable; got {arguments.shown(self.function)}; "
                "pass a function of (t, angle, velocity)"
            )
        object.__setattr__(self, "search", ranges(self.name, self.function, {} if self.search is None else self.search))

    def values(
        self, t: npt.NDArray[Any], angle: npt.NDArray[Any], velocity: npt.NDArray[Any], **inner: float
    ) -> npt.NDArray[np.number]:
        """Return the term at every sample, in the angle's shape, with given inner parameters.

        Raises
        ------
        ValueError
            If the function returns another shape.
        TypeError
            If it returns no real numbers.

        See Also
        --------
        tvident.identify : takes terms.

        References
        ----------
        Equation (1) of docs/mathematics.md: a term is one of its functions g.
        """
        # The result's time and the angle of the next term are not for this function to change.
        returned = self.function(t.copy(), angle.copy(), velocity.copy(), **inner)
        values = arguments.any_array(f"what the function of term {self.name!r} returns", returned)
        if values.shape != angle.shape:
            raise ValueError(
                f"the function of term {self.name!r} must return an array of shape {angle.shape}; got {values.shape}; "
                "return one value for every sample"
            )
        return values


@dataclass(frozen=True)
class FixedTerm:
    """A term whose inner parameters are known, of every record of a batch.

    Parameters
    ----------
    term : Term
    inner : mapping of str to ndarray, shape (records,)
        Values by keyword.
    """

    term: Term
    inner: Mapping[str, npt.NDArray[np.float64]]

    def values(
        self, t: npt.NDArray[Any], angle: npt.NDArray[Any], velocity: npt.NDArray[Any]
    ) -> npt.NDArray[np.number]:
        """Return the term at every sample, in the angle's shape."""
        if not self.inner:
            return self.term.values(t, angle, velocity)
        found = np.empty(angle.shape)
        rows = [one.reshape(-1, angle.shape[-1]) for one in (found, angle, velocity)]
        for record, (into, place, speed) in enumerate(zip(*rows, strict=True)):
            given = {name: float(value[record]) for name, value in self.inner.items()}
            into[:] = self.term.values(t, place, speed, **given)
        return found


GivenTerm: TypeAlias = str | Term | tuple[str | Term, Kind | Expansion]
"""The name of a built-in term, a term of one's own, or a pair of one of these and its kind."""


@dataclass(frozen=True)
class Unknown:
    """A column of the equations: its name, its kind, the term if it is one of the user's own, and its inner parameters."""

    name: str
    kind: Kind
    own: Term | None = None
    inner: tuple[InnerParameter, ...] = ()


def has_kind(given: Any) -> bool:
    """Return whether a term is given as a pair with its kind."""
    return isinstance(given, tuple | list) and len(given) == 2  # noqa: PLR2004 - a pair


def all_terms(terms: Sequence[Any], default: Kind, of_offset: Kind | None = None) -> list[Unknown]:
    """Return every further term with its name and kind: where that is not given the default, or that of an offset."""
    if isinstance(terms, str | Term):
        shown = arguments.shown(terms)
        raise TypeError(f"terms must be a sequence of terms; got {shown}; write ({shown},)")
    if not isinstance(terms, Sequence):
        raise TypeError(f"terms must be a sequence of terms; got {arguments.shown(terms)}; write ('offset',), say")
    found: list[Unknown] = []
    for given in terms:
        pair = has_kind(given)
        term = given[0] if pair else given
        own = term if isinstance(term, Term) else None
        is_offset = own is None and arguments.is_word(term, OFFSET)
        usual = of_offset if is_offset and of_offset is not None else default
        kind = given[1] if pair else usual
        kinds = ("windowed", "constant", "auto") if is_offset else ("windowed", "constant")
        arguments.one_of("the kind of an offset" if is_offset else "the kind of a term", kind, kinds)
        name = arguments.one_of("a term", term, TERM_NAMES) if own is None else own.name
        if any(name.casefold() == other.name.casefold() for other in found):
            raise ValueError(f"every term must have a name of its own; {name!r} comes twice; drop or rename one")
        found.append(Unknown(name, kind, own, _inner_parameters(name, own)))
    names = {one.name.casefold() for one in found}
    for one in (one for term in found for one in term.inner):
        if one.full_name.casefold() in names:
            raise ValueError(
                f"an inner parameter must not share its name with a term; got {one.full_name!r} twice; rename the term"
            )
    return found


def _inner_parameters(name: str, own: Term | None) -> tuple[InnerParameter, ...]:
    """Return what is to be searched in a term."""
    if own is None:
        return tuple(InnerParameter(name, one, None, unit) for one, unit in BUILT_IN[name].inner.items())
    return tuple(InnerParameter(name, one, limits) for one, limits in (own.search or {}).items())
