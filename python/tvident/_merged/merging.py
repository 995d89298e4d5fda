"""What a result of trials or masses is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._merged.elements import Element
from tvident._merged.expanded import FoundExpanded
from tvident._merged.predicted import Equations
from tvident._merged.recorded import MergedRecorded
from tvident._merged.sampling import Sampling
from tvident._merged.structure import Link

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Identifiable:
    """Whether something can be known, and why not. It counts as True where it can."""

    identifiable: bool
    reason: str

    def __bool__(self) -> bool:
        return self.identifiable


@dataclass(frozen=True)
class Part:
    """What one call of the core found, what it was given, how it is done once more for other samples, and which lengths were chosen."""

    found: _core.MergedIdentification | FoundExpanded
    equations: Equations
    again: Callable[[Equations], Part]
    chosen: Sequence[str] = ()

    @property
    def names(self) -> Sequence[str]:
        """Names of the elements, in order."""
        return [element.name for element in self.equations.elements]


@dataclass(frozen=True)
class LackingTerm:
    """A term that a chain lacks: what acts between which two, its factor and the standard error of that."""

    name: str
    link: Link
    value: float
    stderr: float


@dataclass(frozen=True)
class LackingTerms:
    """Terms that a chain lacks.

    Parameters
    ----------
    terms : sequence of LackingTerm
    changes : mapping of str to ndarray
        By how much every element is another beside them.
    """

    terms: Sequence[LackingTerm]
    changes: Mapping[str, Array]


@dataclass(frozen=True)
class Merging:
    """What a result is made of.

    Parameters
    ----------
    elements : sequence of Element
    parts : sequence of Part
        What was found of elements that share no equation with others.
    sampling : Sampling
        When samples were taken.
    step, samples, trials, masses : int
        No masses: one equation of motion, and arrays of shape (n,).
    units : mapping of str to str
    phase : ndarray, shape (samples,), optional
    unknowable : mapping of str to str
        Why some elements cannot be known.
    inertia : mapping of str to ndarray, shape (masses, masses, samples)
        By how much factors of a mechanism enter the matrix of inertia along the motion.
    recorded : MergedRecorded, optional
        Not kept with what is stored.
    is_part : bool
        Whether it is from one time to another of what was recorded.
    terms : sequence of str
        Names of the terms, as asked for.
    kinds_of_terms : mapping of str to str
        Kinds of those that were given one.
    lacking : LackingTerms, optional
        Terms that were found to be missing by trying them.
    """

    elements: Sequence[Element]
    parts: Sequence[Part]
    sampling: Sampling
    step: int
    samples: int
    trials: int
    masses: int
    units: Mapping[str, str]
    phase: Array | None = None
    unknowable: Mapping[str, str] = field(default_factory=dict)
    inertia: Mapping[str, Array] = field(default_factory=dict)
    recorded: MergedRecorded | None = None
    is_part: bool = False
    terms: Sequence[str] = ()
    kinds_of_terms: Mapping[str, str] = field(default_factory=dict)
    lacking: LackingTerms | None = None

    @property
    def factors(self) -> frozenset[str]:
        """Names of a mechanism's factors, which are names of their own; terms of masses are called after both."""
        each = self.elements if self.masses else ()
        return frozenset(one.name for one in each if one.of not in COEFFICIENTS and one.of == one.name)

    @property
    def base_moves(self) -> bool:
        """Whether masses are moved by a base, whose channel follows theirs."""
        entries = [entry for one in self.elements if one.of in COEFFICIENTS for entry in one.entries]
        return self.masses > 0 and any(channel == self.masses for _, _, channel, _ in entries)
