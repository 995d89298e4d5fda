"""What a stream gives of the equation of motion, with names that are put on once they are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._status import DOUBTFUL
from tvident._stream.asked import Equation
from tvident._stream.pieces import times
from tvident._stream.weak import BlockParameters

Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Named:
    """What turns numbers of a stream into results: one for all that it gives.

    Parameters
    ----------
    equation : Equation
    period, start : float
        Seconds from one sample to the next, and the time of the first.
    step : int
        Samples from one result to the next.
    root : float
        What deviations of residuals are multiplied by, to be those of a sample of weight one.
    """

    equation: Equation
    period: float
    start: float
    step: int
    root: float = 1.0


class StreamedIdentification:
    """What an :class:`IdentificationStream` gives for some samples, each with one element of every array.

    Names are put on numbers once they are asked for: a sample that comes alone costs more in names than in arithmetic.

    Attributes
    ----------
    time : ndarray of float64, shape (k,)
        Times of the samples, in seconds.
    values : mapping of str to ndarray, shape (k,)
        Inertia, damping, stiffness and terms, unknown or known.
    stderr : mapping of str to ndarray, shape (k,)
        Their standard errors; NaN where none can be said yet.
    residual_std, condition : ndarray of float64, shape (k,)
    order : ndarray of uint8, shape (k,)
    status : ndarray of uint16, shape (k,)
        As in :class:`tvident.Identification`.
    """

    __slots__ = ("_found", "_named", "_stderr", "_time", "_values")

    def __init__(self, found: BlockParameters | _core.StreamedParameters, named: Named) -> None:
        self._found, self._named = found, named
        # No cached properties: Python 3.11 locks them, which takes longer than what they hold.
        self._time: Numbers | None = None
        self._values: dict[str, Numbers] | None = None
        self._stderr: dict[str, Numbers] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        found = self._found
        kept = BlockParameters(found.first, found.numbers, found.order, found.status)
        return type(self), (kept, self._named)

    def __repr__(self) -> str:
        return f"<StreamedIdentification of {', '.join(self._named.equation.names)} at {self.status.size} samples>"

    @property
    def time(self) -> Numbers:
        """Times of the samples, in seconds."""
        if self._time is None:
            named = self._named
            self._time = times(self._found.first, self.status.size, named.step, named.period, named.start)
        return self._time

    @property
    def values(self) -> Mapping[str, Numbers]:
        """Inertia, damping, stiffness and terms, by name."""
        if self._values is None:
            equation = self._named.equation
            self._values = dict(zip(equation.names, self._found.numbers, strict=False))
            for name, known in equation.held:
                self._values[name] = np.full(self.status.size, known)
        return self._values

    @property
    def stderr(self) -> Mapping[str, Numbers]:
        """Standard errors of the values, by name."""
        if self._stderr is None:
            equation = self._named.equation
            self._stderr = dict(zip(equation.names, self._found.numbers[len(equation.names) :], strict=False))
            for name, _ in equation.held:
                self._stderr[name] = np.zeros(self.status.size)
        return self._stderr

    @property
    def residual_std(self) -> Numbers:
        """Standard deviation of the residuals, in N m; with weights of those of a sample of weight 1."""
        deviation = np.asarray(self._found.numbers[-2])
        return deviation if self._named.root == 1 else deviation * self._named.root

    @property
    def condition(self) -> Numbers:
        """Condition numbers of the equations."""
        return np.asarray(self._found.numbers[-1])

    @property
    def order(self) -> npt.NDArray[np.uint8]:
        """Orders of the polynomials."""
        return self._found.order

    @property
    def status(self) -> npt.NDArray[np.uint16]:
        """Flags: bits of :class:`tvident.Status`."""
        return self._found.status

    @property
    def inertia(self) -> Numbers:
        """Inertia, in kg m²."""
        return self.values["inertia"]

    @property
    def damping(self) -> Numbers:
        """Damping, in N m s/rad."""
        return self.values["damping"]

    @property
    def stiffness(self) -> Numbers:
        """Stiffness, in N m/rad."""
        return self.values["stiffness"]

    @property
    def terms(self) -> dict[str, Numbers]:
        """Factors of further terms, by name."""
        return {name: value for name, value in self.values.items() if name not in COEFFICIENTS}

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        """Where there are numbers, and the status does not say that they are not to be trusted."""
        there = np.all([np.isfinite(value) for value in self.values.values()], axis=0)
        return np.asarray(there & (self.status & np.uint16(DOUBTFUL) == 0))
