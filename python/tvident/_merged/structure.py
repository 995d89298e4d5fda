"""Structures of few masses: chains of springs and dampers, and matrices whose entries are tied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import BUILT_IN, COEFFICIENTS, OFFSET
from tvident._expansion import Expansion
from tvident._merged.elements import Element, Entry, kind_or_number, unmentioned

Link: TypeAlias = tuple[int | Literal["base"], int | Literal["base"]]
"""Two masses, or a mass and the base."""

_LEAST_PAIR = 2

JOINT_TERMS = tuple(name for name, one in BUILT_IN.items() if name != OFFSET and not one.inner)
"""What may act between two masses."""


@arguments.called_as("Chain(masses=2, springs=[('base', 0), (0, 1)])")
@dataclass(frozen=True, eq=False)
class Chain:
    r"""Masses that springs and dampers connect to each other and to a base: what an engineer draws, rather than matrices.

    Few, tied unknowns survive noise where full matrices do not, and forces that act on some masses only are enough for all of them.

    Parameters
    ----------
    masses : int
        Number of masses, one for each row of angle and torque.
    springs : sequence of (int or "base", int or "base")
        What every spring connects: masses count from 0. Two springs between the same masses cannot be distinguished.
    dampers : sequence of (int or "base", int or "base"), optional
        What every damper connects; by default a damper lies beside each spring.
    base : array_like, shape (n,), optional
        Motion of the base, in the unit of the angle unless it says its own (:class:`Channel`): a road, a motor's shaft. By default it
        does not move. Of several trials one row or array for each.
    terms : sequence of (str, (int or "base", int or "base")), optional
        Built-in terms of the motion between two masses, or a mass and the base: ``("coulomb", (0, 1))`` is dry friction in their joint,
        ``("cubic", ("base", 0))`` a spring that hardens. Their factors are constant. A term acts on the second of the two, as a function
        of the second's motion against the first, and back on the first.

    Raises
    ------
    ValueError
        If there is no mass or no spring, a spring connects a mass to itself or to one that is not there, two connect the same, or a term
        is unknown or comes twice.
    TypeError
        If a number is not whole.

    See Also
    --------
    Matrix : kinds and ties of the entries of one matrix.
    identify : takes it as ``structure=``, with ``dof_axis=``.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion. The
    perspective of few degrees of freedom.

    Examples
    --------
    A quarter car on a road that is known:

    >>> import numpy as np
    >>> import tvident
    >>> road = np.zeros(2000)
    >>> car = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)], dampers=[(0, 1)], base=road)
    >>> car.names
    ('inertia_0', 'inertia_1', 'damping_0_1', 'stiffness_base_0', 'stiffness_0_1')
    """

    masses: int
    springs: Sequence[Link]
    dampers: Sequence[Link] | None = None
    base: npt.ArrayLike | Sequence[npt.ArrayLike] | None = field(default=None, repr=False)
    terms: Sequence[tuple[str, Link]] = ()

    def __post_init__(self) -> None:
        masses = arguments.whole_number("masses", self.masses, least=1)
        object.__setattr__(self, "masses", masses)
        object.__setattr__(self, "springs", _links("springs", self.springs, masses))
        if not self.springs:
            raise ValueError("a chain must have a spring; got springs=[]; give pairs such as ('base', 0)")
        dampers = self.springs if self.dampers is None else _links("dampers", self.dampers, masses)
        object.__setattr__(self, "dampers", dampers)
        object.__setattr__(self, "terms", _joint_terms(self.terms, masses))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its elements: a tuple of masses, dampers, springs and terms.

        See Also
        --------
        elements : with what was given of each.
        """
        return tuple(element.name for element in self.elements({}))

    def elements(self, given: Mapping[str, Any]) -> list[Element]:
        """Return its elements, each with what was given of it.

        Parameters
        ----------
        given : mapping of str to object
            For inertia, damping and stiffness a kind, a number or an Expansion for all, one for each in a sequence, or some in a mapping
            by name or by what is connected.

        Returns
        -------
        list of Element

        See Also
        --------
        names : their names.
        Matrix : describes a matrix instead.
        """
        inertias: list[tuple[Any, str]] = [(mass, f"inertia_{mass}") for mass in range(self.masses)]
        dampers = [(link, "_".join(("damping", *map(str, link)))) for link in self.dampers or ()]
        springs = [(link, "_".join(("stiffness", *map(str, link)))) for link in self.springs]
        found = []
        for coefficient, (of, members) in enumerate(zip(COEFFICIENTS, (inertias, dampers, springs), strict=True)):
            values = _each(of, given.get(of), members)
            for (where, name), value in zip(members, values, strict=True):
                entries = [(where, 0, where, 1.0)] if coefficient == 0 else self._entries(where, coefficient)
                found.append(Element(name, of, tuple(entries), kind_or_number(name, value)))
        for place, (term, link) in enumerate(self.terms):
            signs = zip(link, (-1.0, 1.0), strict=True)
            acts = tuple((mass, None, place, sign) for mass, sign in signs if mass != "base")
            found.append(Element("_".join((term, *map(str, link))), term, acts, "constant"))
        return found

    def _entries(self, link: Link, coefficient: int) -> list[Entry]:
        """Return where a spring or a damper appears; the base is the channel after the masses."""
        entries: list[Entry] = []
        for here, there in (link, link[::-1]):
            if here == "base":
                continue
            entries.append((here, coefficient, here, 1.0))
            if there != "base":
                entries.append((here, coefficient, there, -1.0))
            elif self.base is not None:
                entries.append((here, coefficient, self.masses, -1.0))
        return entries


@dataclass(frozen=True, eq=False)
class Matrix:
    """Kinds and ties of the entries of one matrix of the equation of motion, given as ``inertia=``, ``damping=`` or ``stiffness=``.

    Parameters
    ----------
    shape : {"full", "symmetric", "diagonal"}
        ``"full"``: every entry is an unknown of its own. ``"symmetric"``: entries that mirror each other are one. ``"diagonal"``: the
        others are zero.
    kind : str, float or Expansion
        Of every entry that `entries` does not name.
    entries : mapping of (int, int) to str, float or Expansion, optional
        Kinds, known values or functions of some entries; of a symmetric matrix one stands for its mirror image, too.
    tied : sequence of sequence of (int, int), optional
        Entries that are one unknown.

    Raises
    ------
    ValueError
        If a word is unknown, an entry is tied twice, or one of a symmetric matrix is something else than its mirror image.

    See Also
    --------
    Chain : springs and dampers between masses.
    identify : takes it, with ``dof_axis=``.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion. The
    perspective of few degrees of freedom.

    Examples
    --------
    >>> import tvident
    >>> tvident.Matrix("symmetric", "windowed", entries={(1, 1): "constant"}).shape
    'symmetric'
    """

    shape: Literal["full", "symmetric", "diagonal"] = "full"
    kind: str | float | Expansion = "auto"
    entries: Mapping[tuple[int, int], str | float | Expansion] = field(default_factory=dict)
    tied: Sequence[Sequence[tuple[int, int]]] = ()

    def __post_init__(self) -> None:
        arguments.one_of("shape", self.shape, ("full", "symmetric", "diagonal"))
        kind_or_number("kind", self.kind)
        try:
            groups = [tuple((int(row), int(column)) for row, column in group) for group in self.tied]
        except (TypeError, ValueError):
            raise TypeError(
                f"tied must be groups of entries; got {arguments.shown(self.tied)}; write [[(0, 0), (1, 1)]], say"
            ) from None
        if not isinstance(self.entries, Mapping):
            raise TypeError(
                f"entries must be a mapping of places to kinds or numbers; got {arguments.shown(self.entries)}; write {{(0, 1): 0.0}}, say"
            )
        # Of a symmetric matrix an entry and its mirror image are one, and a group may name both.
        each = [entry for group in groups for entry in dict.fromkeys(map(self._one_of, group))]
        if len(each) != len(set(each)):
            raise ValueError(f"an entry must be tied once; got tied={self.tied}; merge the groups that share an entry")
        object.__setattr__(self, "tied", tuple(groups))
        for entry, value in self.entries.items():
            other = self.entries.get(self._one_of(entry), value)
            # Channels of functions are arrays, which are not compared.
            if other is not value and (isinstance(value, Expansion) or other != value):
                raise ValueError(
                    f"an entry of a symmetric matrix must be what its mirror image is; got {arguments.shown(value)} for {entry} and "
                    f"{arguments.shown(self.entries[self._one_of(entry)])} for {self._one_of(entry)}; give one of them, or shape='full'"
                )

    def elements(self, of: str, masses: int) -> list[Element]:
        """Return the elements of the matrix.

        Parameters
        ----------
        of : str
            Inertia, damping or stiffness.
        masses : int
            How many rows it has.

        Returns
        -------
        list of Element

        See Also
        --------
        Chain.elements : those of springs and masses.
        """
        coefficient = COEFFICIENTS.index(of)
        everywhere = list(product(range(masses), repeat=2))
        unmentioned(f"entries of the {of}", self.entries, everywhere)
        unmentioned(f"tied entries of the {of}", dict.fromkeys(e for group in self.tied for e in group), everywhere)
        leader = {self._one_of(entry): self._one_of(group[0]) for group in self.tied for entry in group}
        groups: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for row, column in everywhere:
            if self.shape == "diagonal" and row != column and (row, column) not in self.entries:
                continue
            mirrored = self._one_of((row, column))
            first = leader.get(mirrored, mirrored)
            groups.setdefault(first, []).append((row, column))
        found = []
        for first, members in groups.items():
            name = f"{of}_{first[0]}_{first[1]}"
            given = [self.entries[one] for one in (first, *members) if one in self.entries]
            value = kind_or_number(name, given[0] if given else self.kind)
            entries = tuple((row, coefficient, column, 1.0) for row, column in members)
            found.append(Element(name, of, entries, value))
        return found

    def _one_of(self, entry: tuple[int, int]) -> tuple[int, int]:
        """Return the entry that stands for one and for what mirrors it."""
        return (min(entry), max(entry)) if self.shape == "symmetric" else entry


def matrices(given: Mapping[str, Any], masses: int) -> list[Element]:
    """Return the elements of full matrices, each given as a kind or a number, a nested list of them, or a :class:`Matrix`."""
    found = []
    for of in COEFFICIENTS:
        value = given.get(of)
        if isinstance(value, Matrix):
            one = value
        elif value is None or _is_single(value):
            scalar: Any = "auto" if value is None else value
            one = Matrix("full" if isinstance(scalar, str | Expansion) else "diagonal", scalar)
        else:
            rows = [list(row) if isinstance(row, Sequence | np.ndarray) else [row] for row in value]
            if len(rows) != masses or any(len(row) != masses for row in rows):
                raise ValueError(
                    f"{of} must have {masses} rows of {masses} entries, one for each mass; got {arguments.shown(value)}; "
                    "give a kind, a number or an Expansion for every entry"
                )
            each = {
                (i, j): float(one) if _is_single(one) and not isinstance(one, str | Expansion) else one
                for i, row in enumerate(rows)
                for j, one in enumerate(row)
            }
            one = Matrix("full", "auto", each)
        found += one.elements(of, masses)
    return found


def _links(name: str, links: Sequence[Link], masses: int) -> tuple[Link, ...]:
    """Return pairs of masses, checked."""
    found: list[Link] = []
    if not arguments.is_several(links):
        raise TypeError(
            f"{name} must be a list of pairs; got {arguments.shown(links)}; write [('base', 0), (0, 1)], say"
        )
    for link in links:
        if isinstance(link, str) or not isinstance(link, Sized) or len(link) != _LEAST_PAIR:
            raise ValueError(
                f"{name} must be pairs; got {arguments.shown(link)}; give pairs such as ('base', 0) or (0, 1)"
            )
        ends = tuple(end if end == "base" else arguments.whole_number(name, end, least=0) for end in link)
        if ends[0] == ends[1] or any(end != "base" and end >= masses for end in ends):
            raise ValueError(
                f"{name} must connect two different masses below {masses}, or one and 'base'; got {arguments.shown(link)}; "
                "count masses from 0"
            )
        if any(set(ends) == set(other) for other in found):
            raise ValueError(
                f"{name} must connect different pairs, since two between the same cannot be distinguished; got {arguments.shown(link)} "
                "twice; leave one out"
            )
        found.append((ends[0], ends[1]))
    return tuple(found)


def _joint_terms(terms: Any, masses: int) -> tuple[tuple[str, Link], ...]:
    """Return terms and what each acts between, checked."""
    if not arguments.is_several(terms):
        raise TypeError(
            f"terms of a chain must be a list of pairs; got {arguments.shown(terms)}; write [('coulomb', (0, 1))], say"
        )
    found: list[tuple[str, Link]] = []
    for given in terms:
        if not isinstance(given, tuple | list) or len(given) != _LEAST_PAIR:
            raise ValueError(
                f"terms of a chain must be pairs of a name and what it acts between; got {arguments.shown(given)}; write "
                "('coulomb', (0, 1)), say; terms of single masses are given to identify(terms=)"
            )
        name, link = given
        arguments.one_of("a term of a chain", name, JOINT_TERMS)
        (ends,) = _links("what a term acts between", [link], masses)
        if any(name == other and set(ends) == set(between) for other, between in found):
            raise ValueError(f"a term must act between two once; got {arguments.shown(given)} twice; leave one out")
        found.append((name, ends))
    return tuple(found)


def between(link: Link, angles: Sequence[npt.NDArray[Any]], masses: int) -> npt.NDArray[np.float64]:
    """Return the angle of the second of two against the first; the base is the channel after the masses, or at rest."""

    def of(end: int | Literal["base"]) -> Any:
        if end != "base":
            return np.asarray(angles[end], np.float64)
        return np.asarray(angles[masses], np.float64) if len(angles) > masses else 0.0

    return np.asarray(of(link[1]) - of(link[0]), np.float64)


def _is_single(given: Any) -> bool:
    """Return whether something is one kind, number or Expansion, or nothing, rather than several."""
    if isinstance(given, np.ndarray):
        return given.ndim == 0
    return isinstance(given, str) or not isinstance(given, Sequence | Mapping)


def _each(of: str, given: Any, members: Sequence[tuple[Any, str]]) -> list[Any]:
    """Return what was given of every element of a kind."""
    if isinstance(given, Matrix):
        raise ValueError(  # noqa: TRY004 - it goes with another structure
            f"{of} must be given by elements beside a Chain; got a Matrix; leave structure= out, or give one kind"
        )
    if _is_single(given):
        return ["auto" if given is None else given] * len(members)
    if isinstance(given, Mapping):
        unmentioned(of, given, [key for member in members for key in member])
        return [given.get(name, given.get(where, "auto")) for where, name in members]
    values = list(given)
    if len(values) != len(members):
        raise ValueError(
            f"{of} must be given for each of {len(members)} elements: {', '.join(name for _, name in members)}; got {len(values)}; "
            "give one kind or number for each, or a mapping by name"
        )
    return values
