"""Elements: the unknowns of merged equations, and where each of them appears."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import COEFFICIENTS, Kind, parameter
from tvident._expansion import Expansion, Places, check_expansion, refuse, refuse_windows, with_channels
from tvident._merged.sampling import Sampling

Entry = tuple[int, int | None, int, float]
"""Equation, coefficient of the motion (0 inertia, 1 damping, 2 stiffness; None for a term), channel or term, factor."""


@dataclass(frozen=True)
class Element:
    """One coefficient of the equations.

    Parameters
    ----------
    name : str
    of : str
        Inertia, damping, stiffness, or the name of a term.
    entries : tuple of Entry
        Where it appears.
    value : str, float or Expansion
        A kind of unknown, what is known, or the functions of which it is a sum.
    """

    name: str
    of: str
    entries: tuple[Entry, ...]
    value: Kind | float | Expansion

    @property
    def is_known(self) -> bool:
        """Whether it is a number already."""
        return not isinstance(self.value, str | Expansion)

    @property
    def number(self) -> float:
        """What is known of it; NaN where nothing is."""
        return float("nan") if isinstance(self.value, str | Expansion) else float(self.value)

    @property
    def expansion(self) -> Expansion | None:
        """The functions of which it is a sum, if it is."""
        return self.value if isinstance(self.value, Expansion) else None

    @property
    def places(self) -> Places:
        """Where it appears, as rows of expansions have it."""
        momentum = self.expansion is not None and self.expansion.inertia_times == "momentum"
        roles = ("momentum" if momentum else "inertia", *COEFFICIENTS[1:])
        return [
            (equation, "term" if of is None else roles[of], channel, factor)
            for equation, of, channel, factor in self.entries
        ]

    @property
    def in_windows(self) -> Element:
        """The element with windows, or what the record decides, in the place of functions."""
        if self.expansion is None:
            return self
        # Those of terms and of stiffness may change where a test sees nothing of it yet.
        return replace(self, value="auto" if self.of in COEFFICIENTS[:2] else "windowed")

    @property
    def equations(self) -> frozenset[int]:
        """Equations that it appears in."""
        return frozenset(entry[0] for entry in self.entries)

    def at(self, equations: Sequence[int]) -> Element:
        """Return the element as it is where only some equations are left, which are then counted anew."""
        places = {equation: place for place, equation in enumerate(equations)}
        kept = tuple((places[entry[0]], *entry[1:]) for entry in self.entries if entry[0] in places)
        return Element(self.name, self.of, kept, self.value)

    def given(self) -> tuple[list[Entry], float | None, str]:
        """Return the element as the core takes it: windows follow what varies slowly, too."""
        if isinstance(self.value, str):
            return list(self.entries), None, "windowed" if self.value == "varying" else self.value
        return list(self.entries), self.number, "constant"


def on_grid(element: Element, sampling: Sampling) -> Element:
    """Return an element whose functions are of channels on a uniform grid."""
    one = element.expansion
    if one is None or sampling.clock is None:
        return element
    return replace(element, value=with_channels(one, sampling.known))


def terms_of(inside: Sequence[Element], elements: Sequence[Element]) -> list[tuple[int, str]]:
    """Return places and names of the terms in some elements."""
    names = {one.name for one in inside}
    return [(entry[2], one.name) for one in elements if one.name in names for entry in one.entries if entry[1] is None]


def renumbered(element: Element, order: Mapping[int, int]) -> Element:
    """Return an element whose terms are counted anew."""
    entries = tuple(
        entry if entry[1] is not None else (*entry[:2], order[entry[2]], entry[3]) for entry in element.entries
    )
    return replace(element, entries=entries)


def rewired(element: Element, places: Mapping[int, int]) -> Element:
    """Return an element whose channels are counted anew."""
    entries = tuple(
        entry if entry[1] is None else (*entry[:2], places[entry[2]], entry[3]) for entry in element.entries
    )
    return replace(element, entries=entries)


def kind_or_number(name: str, value: object) -> Kind | float | Expansion:
    """Return how one element comes about; None is as if nothing were said of it.

    Raises
    ------
    ValueError
        If it is an array, which merged rows cannot take off yet.
    """
    if isinstance(value, Expansion):
        return value
    if not isinstance(value, str) and hasattr(value, "__len__"):
        raise ValueError(
            f"{name} must be a number where it is known, beside ensemble_axis= and dof_axis=; got {arguments.shown(value)}; what is known "
            "at every sample is not supported there yet: take its part of the torque off the torque"
        )
    found = parameter(name, "auto" if value is None else value, ())
    assert not isinstance(found, np.ndarray)  # noqa: S101 - it has no length
    return found


def check_expansions(elements: Sequence[Element], samples: int, *, has_momenta: bool = False) -> None:
    """Refuse windows beside sums of functions, functions that rows cannot use, and channels of another length.

    Raises
    ------
    ValueError
        If there are any, or if momenta follow from smoothed velocities: their noise is not known.
    """
    expanded = [(one, one.expansion) for one in elements if one.expansion is not None]
    if not expanded:
        return
    first = expanded[0][0].name
    if has_momenta:
        refuse(
            f"an Expansion of {first} needs channels as they were recorded",
            "a Mechanism, whose momenta follow from smoothed velocities",
            "use 'windowed', or give it one energy for each of the functions",
        )
    for one, expansion in expanded:
        check_expansion(one.name, one.places, expansion, samples)
    refuse_windows(first, {one.name: one.value for one in elements})


def unmentioned(name: str, given: Mapping[Any, object], known: Sequence[Any]) -> None:
    """Refuse keys of a mapping that name no element.

    Raises
    ------
    ValueError
        If one is unknown.
    """
    for key in given:
        if key not in known:
            some = ", ".join(arguments.shown(one) for one in known[:4])
            raise ValueError(
                f"{name} must name elements that there are: {some} …; got {arguments.shown(key)}; use one of these"
            )


def matrix_of(elements: Sequence[Element], coefficient: int, masses: int) -> dict[str, npt.NDArray[np.float64]]:
    """Return by how much every element of a kind enters each entry of its matrix."""
    found = {}
    for element in elements:
        pattern = np.zeros((masses, masses))
        for equation, of, channel, factor in element.entries:
            if of == coefficient and channel < masses:
                pattern[equation, channel] += factor
        if element.of == COEFFICIENTS[coefficient]:
            found[element.name] = pattern
    return found
