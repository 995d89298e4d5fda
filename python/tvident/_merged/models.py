"""Identified equations as they are simulated: those of one mass, of linear masses, and of any others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._equation import BUILT_IN, COEFFICIENTS, FRICTION, OFFSET, FixedTerm
from tvident._merged.elements import Element, matrix_of
from tvident._merged.mechanism import Mechanism, steps_of
from tvident._merged.merging import Merging
from tvident._merged.not_linear import General, NotLinear, TermFunction
from tvident._merged.response import LinearMasses
from tvident._merged.structure import Link, between
from tvident._results import Model, without_gaps

Array: TypeAlias = npt.NDArray[np.float64]


_TURNING = 0.02
"""Part of the velocity between two masses, in the root mean square, over which dry friction between them changes its direction."""


_ENDS = 2
"""Of what a term acts between."""


class Responding(Protocol):
    """Equations whose response is known."""

    def respond(self, forces: Array, initial: Array | None, angles: Array | None) -> tuple[Array, Array]:
        """Return angles, shape (masses, n), and the state at the first sample, shape (2, masses).

        The state is the initial one, or the one from which angles are explained best.
        """


def model_of(merging: Merging, values: Mapping[str, Array], base: Array | None) -> Responding:
    """Return the equations of one trial.

    Parameters
    ----------
    merging : Merging
    values : mapping of str to ndarray, shape (n,)
        Of every element at every sample.
    base : ndarray, shape (n,), optional
    """
    own = {} if merging.recorded is None else merging.recorded.own
    beside = [one for one in merging.elements if one.of not in COEFFICIENTS and one.name not in merging.factors]
    for one in beside:
        if one.of not in own and (one.of not in BUILT_IN or BUILT_IN[one.of].inner):
            raise ValueError(
                f"terms must be there to be simulated; the function of {one.of!r} was not stored with the result; identify again"
            )
    period = merging.sampling.period
    if not merging.masses:
        lasting = {name: value[:1] if np.ptp(value) == 0 else value for name, value in values.items()}
        return OneMass(Model(lasting, {name: FixedTerm(one, {}) for name, one in own.items()}, period, 0.0, [0.0], 0))
    samples = next(iter(values.values())).size
    count = merging.masses
    matrices = [
        sum(
            (
                pattern[:, :, np.newaxis] * values[name]
                for name, pattern in matrix_of(merging.elements, of, count).items()
            ),
            np.zeros((count, count, samples)),
        )
        for of in range(len(COEFFICIENTS))
    ]
    offsets, friction, terms = _beside(beside, values, merging, base, samples)
    shift, held = _of_base(merging, values, base)
    inertia, damping, stiffness = matrices
    if not merging.factors and not terms and not friction.any():
        return Linear(LinearMasses(inertia, damping, stiffness, period), shift - offsets, held)
    structure = None if merging.recorded is None else merging.recorded.structure
    if merging.factors and structure is None:
        raise ValueError(
            "a mechanism must be there to be simulated; its functions were not stored with the result; identify again"
        )
    mechanism = structure if isinstance(structure, Mechanism) else None
    factors = {name: _between(values[name]) for name in ([] if mechanism is None else mechanism.names)}
    step = np.ones(count) if merging.recorded is None else steps_of(np.stack(merging.recorded.angles[0][:count]))
    each = [(moves, _between(along), term) for moves, along, term in terms]
    at_rest = (_between(inertia), _between(damping), _between(stiffness))
    equations = General(*at_rest, each, period, mechanism, factors, step)
    return NotLinear(equations, _between(friction), shift - offsets, held, period)


def _beside(
    elements: Sequence[Element], values: Mapping[str, Array], merging: Merging, base: Array | None, samples: int
) -> tuple[Array, Array, list[tuple[Array, Array, TermFunction]]]:
    """Return the offsets and the dry friction of every mass, and what else acts beside matrices."""
    own = {} if merging.recorded is None else merging.recorded.own
    offsets, friction = np.zeros((2, merging.masses, samples))
    terms: list[tuple[Array, Array, TermFunction]] = []
    for one in elements:
        mass, along = one.entries[0][0], values[one.name]
        moves = np.zeros(merging.masses)
        for entry in one.entries:
            moves[entry[0]] += entry[3]
        link = _link_of(one)
        if link is not None:
            terms.append((moves, along, _between_masses(one.of, link, merging, base)))
        elif one.of == OFFSET:
            offsets[mass] += along
        elif one.of == FRICTION and (along >= 0).all():
            friction[mass] += along
        elif one.of == FRICTION:
            # What drives, be it by chance, does not stick.
            terms.append((moves, along, lambda _time, _q, v: np.sign(v)))
        else:
            terms.append((moves, along, _function(one.of, own)))
    return offsets, friction, terms


@dataclass(frozen=True)
class OneMass:
    """The equation of one mass."""

    model: Model

    def respond(self, forces: Array, initial: Array | None, angles: Array | None) -> tuple[Array, Array]:
        """Return the angle, and the state at the first sample."""
        how: dict[str, Any] = {"initial": initial[:, 0]} if initial is not None else {}
        if initial is None and angles is not None:
            how = {"angle": angles[0]}
        angle, velocity = self.model.respond(forces[0], **how)
        return angle[np.newaxis], np.array([[angle[0]], [velocity[0]]])


@dataclass(frozen=True)
class Linear:
    """Linear equations of masses.

    Parameters
    ----------
    masses : LinearMasses
    beside : ndarray, shape (masses, n)
        What acts beside the torques.
    held : ndarray, shape (masses, n - 1), optional
        What is constant between two samples.
    """

    masses: LinearMasses
    beside: Array
    held: Array | None

    def respond(self, forces: Array, initial: Array | None, angles: Array | None) -> tuple[Array, Array]:
        """Return the angles, and the state at the first sample."""
        return self.masses.respond(forces + self.beside, initial, angles, held=self.held)


def _of_base(merging: Merging, values: Mapping[str, Array], base: Array | None) -> tuple[Array, Array | None]:
    """Return with which forces a base acts: those that follow its position, and those of its velocity between two samples."""
    samples = next(iter(values.values())).size
    shift, held = np.zeros((merging.masses, samples)), np.zeros((merging.masses, max(samples - 1, 0)))
    if base is None:
        return shift, None
    velocity = np.diff(base) / merging.sampling.period
    for one in merging.elements:
        for equation, of, channel, factor in one.entries if one.of in COEFFICIENTS else ():
            if channel != merging.masses:
                continue
            if of == COEFFICIENTS.index("stiffness"):
                shift[equation] -= factor * values[one.name] * base
            else:
                held[equation] -= factor * _between(values[one.name]) * velocity
    return shift, held


def _between(values: Array) -> Array:
    """Return the means of neighbouring samples, along the last axis."""
    return np.asarray((values[..., 1:] + values[..., :-1]) / 2)


def _link_of(element: Element) -> Link | None:
    """Return what a term acts between, as its name says; None where it is of one mass."""
    ends: list[int | Literal["base"]] = [
        "base" if end == "base" else int(end) for end in element.name.removeprefix(f"{element.of}_").split("_")
    ]
    return (ends[0], ends[1]) if len(ends) == _ENDS else None


def _between_masses(name: str, link: Link, merging: Merging, base: Array | None) -> TermFunction:
    """Return a term of the motion of one end of a link against the other.

    Dry friction slides there and does not stick: its direction changes over a part of the velocities that were recorded.
    """
    period = merging.sampling.period
    function = _function(name, {})
    if name == FRICTION:
        if merging.recorded is None:
            raise ValueError(
                "the recording must be there to simulate dry friction between masses; it was not stored with the result; identify again"
            )
        angle = without_gaps(between(link, merging.recorded.angles[0], merging.masses)[np.newaxis])[0]
        turning = _TURNING * float(np.std(np.gradient(angle, period))) or 1.0
        function = lambda _time, _q, v: np.tanh(v / turning)  # noqa: E731 - as the other terms
    if base is None or "base" not in link:
        return function
    moving, times, sign = base, np.arange(base.size) * period, 1.0 if link[0] == "base" else -1.0
    rate = np.gradient(moving, period)
    return lambda time, q, v: function(
        time, q - sign * np.interp(time, times, moving), v - sign * np.interp(time, times, rate)
    )


def _function(name: str, own: Mapping[str, Any]) -> TermFunction:
    """Return a term as a function of time, angle and velocity."""
    if name in own:
        given = own[name]
        return lambda time, q, v: np.asarray(given.values(time, q, v), np.float64)
    built_in = BUILT_IN[name]
    return lambda _, q, v: np.asarray(built_in.function(np, q, v), np.float64)
