"""Elements: the unknowns of merged equations, and where each of them appears."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import COEFFICIENTS, Kind, parameter
from tvident._expansion import Expansion

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
    value : str or float
        A kind of unknown, or what is known.
    """

    name: str
    of: str
    entries: tuple[Entry, ...]
    value: Kind | float

    @property
    def is_known(self) -> bool:
        """Whether it is a number already."""
        return not isinstance(self.value, str)

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
        """Return the element as the core takes it."""
        if isinstance(self.value, str):
            return list(self.entries), None, self.value
        return list(self.entries), float(self.value), "constant"


def kind_or_number(name: str, value: object) -> Kind | float:
    """Return how one element comes about; None is as if nothing were said of it.

    Raises
    ------
    ValueError
        If it is an array, or varies slowly, which merged rows cannot follow yet.
    """
    if isinstance(value, Expansion):
        raise ValueError(  # noqa: TRY004 - it is right beside one record
            f"{name} must be 'windowed', 'constant', 'auto' or a number beside ensemble_axis= and dof_axis=; got an Expansion, which is "
            "not supported there yet; use 'windowed', or identify one trial of one mass"
        )
    found = parameter(name, "auto" if value is None else value, ())
    if found == "varying":
        raise ValueError(
            f"{name} must be 'windowed', 'constant', 'auto' or a number beside ensemble_axis= and dof_axis=; got 'varying', which is not "
            "supported there yet; use 'windowed'"
        )
    if isinstance(found, np.ndarray):
        raise ValueError(  # noqa: TRY004 - arrays are known parameters elsewhere
            f"{name} must be a number where it is known, beside ensemble_axis= and dof_axis=; got an array, which is not supported there "
            "yet; take its part of the torque off the torque"
        )
    return found


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
