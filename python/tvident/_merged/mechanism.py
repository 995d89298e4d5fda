"""Mechanisms: equations of motion that follow from energies, linear in unknown factors that several of them share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import Kind, name_of_term
from tvident._merged.elements import Element, Entry, kind_or_number, unmentioned

Array: TypeAlias = npt.NDArray[np.float64]

OfMotion: TypeAlias = Callable[[Array, Array], Any]
OfPosition: TypeAlias = Callable[[Array], Any]

_STEP = 1e-3
"""Part of a coordinate's spread by which it is moved to find slopes; those of fourth order are then wrong by a part of 1e-13 or so."""


@arguments.called_as("Mechanism(kinetic={'mass': lambda q, q_dot: 0.5 * q_dot[0] ** 2})")
@dataclass(frozen=True, eq=False)
class Mechanism:
    r"""Bodies whose equations of motion follow from their energies: an arm, a double pendulum, a crank, a robot.

    Kinetic and potential energy are sums of functions of the user's with unknown factors: T = Σ x T_x(q, q̇) and V = Σ x V_x(q). Lagrange's
    equations d(∂T/∂q̇)/dt - ∂T/∂q + ∂V/∂q + terms = τ are linear in the factors, and one factor appears in all equations that it belongs
    to. In weak form the momenta ∂T/∂q̇ are integrated by parts, so that accelerations are never estimated, and an inertia that depends
    on the position (I(q) q̈ and what its change adds) is right by itself.

    Parameters
    ----------
    kinetic : mapping of str to callable
        For every factor a function ``T(q, v)`` of positions and velocities, shape (masses, n), which returns shape (n,) and is quadratic
        in ``v``.
    potential : mapping of str to callable, optional
        For every factor a function ``V(q)``, which returns shape (n,). A name that `kinetic` has too is the same factor.
    forces : mapping of str to callable, optional
        What has no energy: for every factor a function ``f(q, v)`` that returns the left-hand side, shape (masses, n), or one array or
        number for each mass: ``{"drag": lambda q, v: (v[0] * abs(v[0]), 0)}``.
    kinds : mapping of str to str or float, optional
        ``"constant"`` (the default), ``"windowed"``, ``"auto"`` or a known value, by the name of a factor.

    Raises
    ------
    ValueError
        If there is no function, or a name is taken or is of no factor.
    TypeError
        If a function cannot be called.

    Notes
    -----
    Functions take smoothed positions and velocities, of local polynomials in windows of 51 samples, and are moved by small steps to find
    their slopes. How noise enters them is not known, so widths of the test function are compared (``scan()``), and standard errors are from
    how blocks of the record scatter where the channels' noise does not explain what is left. Dry friction of a joint is a term,
    ``terms=["coulomb"]``; friction in proportion to the velocity is ``damping=tvident.Matrix("diagonal", "constant")``.

    See Also
    --------
    Chain : masses with springs and dampers between them.
    identify : takes it as ``structure=``, with ``dof_axis=``.

    References
    ----------
    M. Gautier, W. Khalil: On the identification of the inertial parameters of robots, CDC 1988: energies are linear in them.

    Examples
    --------
    A double pendulum whose second angle is relative to the first:

    >>> import numpy as np
    >>> import tvident
    >>> pendulum = tvident.Mechanism(
    ...     kinetic={
    ...         "A": lambda q, v: v[0] ** 2 / 2,
    ...         "I2": lambda q, v: (v[0] + v[1]) ** 2 / 2,
    ...         "h": lambda q, v: np.cos(q[1]) * v[0] * (v[0] + v[1]),
    ...     },
    ...     potential={"g1": lambda q: -np.cos(q[0]), "g2": lambda q: -np.cos(q[0] + q[1])},
    ... )
    >>> pendulum.names
    ('A', 'I2', 'h', 'g1', 'g2')
    """

    kinetic: Mapping[str, OfMotion]
    potential: Mapping[str, OfPosition] = field(default_factory=dict)
    forces: Mapping[str, OfMotion] = field(default_factory=dict)
    kinds: Mapping[str, Kind | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for of in ("kinetic", "potential", "forces"):
            functions = dict(arguments.mapping(of, getattr(self, of), "{'inertia of a link': function}"))
            for name, function in functions.items():
                name_of_term(name)
                if not callable(function):
                    raise TypeError(
                        f"{of}[{name!r}] must be callable; got {arguments.shown(function)}; pass a function of (q, v), "
                        "or of (q) for a potential"
                    )
            object.__setattr__(self, of, functions)
        if not self.kinetic and not self.potential:
            raise ValueError("a mechanism must have an energy; got none; give kinetic={'inertia of …': function}")
        arguments.mapping("kinds", self.kinds, "{'inertia of a link': 'constant'}")
        unmentioned("kinds of a mechanism", self.kinds, self.names)
        for name, kind in self.kinds.items():
            kind_or_number(name, kind)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its factors: a tuple of str.

        See Also
        --------
        regressors : what they multiply.
        """
        return tuple(dict.fromkeys((*self.kinetic, *self.potential, *self.forces)))

    def regressors(self, q: Array, v: Array) -> Regressors:
        """Return its factors' regressors along a motion, shape (masses, n).

        Raises
        ------
        ValueError
            If a function returns another shape.

        See Also
        --------
        dynamics : the same for simulation.

        References
        ----------
        Lagrange's equations; J. Swevers, W. Verdonck, J. De Schutter: Dynamic model identification for industrial robots, IEEE Control
        Systems Magazine 27 (2007), for equations that are linear in their factors.
        """
        momenta: list[Array] = []
        forces: list[Array] = []
        elements = []
        for name in self.names:
            momentum, force = self._of(name, q, v)
            entries: list[Entry] = []
            for mass in range(len(q)):
                # Where a factor does not appear it ties nothing.
                if np.any(momentum[mass]):
                    # The slope of a momentum is to it as a velocity is to an angle.
                    entries.append((mass, 1, len(q) + len(momenta), 1.0))
                    momenta.append(momentum[mass])
                if np.any(force[mass]):
                    entries.append((mass, None, len(forces), 1.0))
                    forces.append(force[mass])
            elements.append(Element(name, name, tuple(entries), kind_or_number(name, self.kinds.get(name, "constant"))))
        return Regressors(elements, momenta, forces, {name: self._inertia(name, q) for name in self.kinetic})

    def dynamics(self, factors: Mapping[str, float], q: Array, v: Array, step: Array) -> tuple[Array, Array]:
        """Return the matrix of inertia, shape (n, masses, masses), and all forces but the accelerations' at some states.

        Parameters
        ----------
        factors : mapping of str to float
        q, v : ndarray, shape (masses, n)
        step : ndarray, shape (masses,)
            By which coordinates are moved to find slopes.

        See Also
        --------
        regressors : the same for identification.
        MergedIdentification.simulate : integrates them.

        References
        ----------
        Lagrange's equations: docs/together.md.
        """
        masses, states = q.shape
        pairs, speeds, units = _around(masses)
        moved = units * step
        places = (q.T[np.newaxis] + moved[:, np.newaxis]).transpose(2, 0, 1)
        shape = (masses, len(moved), speeds.shape[1], states)
        both = [
            np.ascontiguousarray(np.broadcast_to(one, shape)).reshape(masses, -1)
            for one in (places[:, :, np.newaxis], speeds[:, np.newaxis, :, np.newaxis])
        ]
        energy = sum(
            (factors[name] * _energy(f"kinetic[{name!r}]", one, *both) for name, one in self.kinetic.items()),
            np.zeros(both[0].shape[1]),
        ).reshape(shape[1:])
        inertia = np.empty((len(moved), masses, masses, states))
        for place, (i, j) in enumerate(pairs):
            inertia[:, i, j] = inertia[:, j, i] = (energy[:, place] - energy[:, place + len(pairs)]) / 2
        slope = _slope(inertia, step)
        rest = np.einsum("kijs,ks,js->is", slope, v, v) - np.einsum("ijks,js,ks->is", slope, v, v) / 2
        flat = places.reshape(masses, -1)
        height = sum(
            (factors[name] * _energy(f"potential[{name!r}]", one, flat) for name, one in self.potential.items()),
            np.zeros(flat.shape[1]),
        )
        rest += _slope(height.reshape(len(moved), states), step)
        for name in self.forces:
            rest += factors[name] * self._force(name, q, v)
        return inertia[0].transpose(2, 0, 1), rest

    def _force(self, name: str, q: Array, v: Array) -> Array:
        """Return what has no energy."""
        given = self.forces[name](q.copy(), v.copy())
        try:
            return np.stack([np.broadcast_to(np.asarray(one, np.float64), q.shape[1:]) for one in given])
        except ValueError:
            raise ValueError(
                f"forces[{name!r}] must return an array of shape {q.shape}, or one array or number for each mass; got "
                f"{arguments.shown(given)}; return (first, second, …)"
            ) from None

    def _of(self, name: str, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the momenta and the forces of one factor, each of shape (masses, n)."""
        momentum, force = np.zeros(q.shape), np.zeros(q.shape)
        if name in self.kinetic:
            kinetic = partial(_energy, f"kinetic[{name!r}]", self.kinetic[name])
            momentum += self._momentum(name, q, v)
            force -= _slopes(lambda moved: kinetic(moved, v), q)
        if name in self.potential:
            energy = partial(_energy, f"potential[{name!r}]", self.potential[name])
            force += _slopes(energy, q)
        if name in self.forces:
            force += self._force(name, q, v)
        return momentum, force

    def _momentum(self, name: str, q: Array, v: Array) -> Array:
        """Return ∂T/∂q̇: of a quadratic function differences are exact, whatever the step."""
        energy = partial(_energy, f"kinetic[{name!r}]", self.kinetic[name])
        steps = np.sqrt(np.nanmean(v**2, axis=1)) if np.isfinite(v).any() else np.ones(len(v))
        found = []
        for mass, step in enumerate(np.where(steps > 0, steps, 1.0)):
            moved = np.zeros((len(v), 1))
            moved[mass] = step
            found.append((energy(q, v + moved) - energy(q, v - moved)) / (2 * step))
        return np.stack(found)

    def _inertia(self, name: str, q: Array) -> Array:
        """Return what a factor adds to the matrix of inertia along a motion, shape (masses, masses, n)."""
        columns = []
        for mass in range(len(q)):
            unit = np.zeros(q.shape)
            unit[mass] = 1.0
            columns.append(self._momentum(name, q, unit))
        return np.stack(columns, axis=1)


@dataclass(frozen=True)
class Regressors:
    """What the factors of a mechanism multiply.

    Parameters
    ----------
    elements : list of Element
        Momenta are channels that follow those of the masses, forces are terms.
    momenta, forces : list of ndarray, shape (n,)
    inertia : dict of str to ndarray, shape (masses, masses, n)
        By how much every factor enters the matrix of inertia.
    """

    elements: list[Element]
    momenta: list[Array]
    forces: list[Array]
    inertia: dict[str, Array]


def _energy(name: str, function: Callable[..., Any], *motion: Array) -> Array:
    """Return an energy at every sample."""
    # They are copies, which the function may change.
    found = np.asarray(function(*(one.copy() for one in motion)), np.float64)
    samples = motion[0].shape[1]
    if found.ndim and found.shape != (samples,):
        raise ValueError(
            f"{name} must return an array of shape {(samples,)}; got {found.shape}; return one energy for every sample"
        )
    return found if found.ndim else np.full(samples, found)


@cache
def _around(masses: int) -> tuple[list[tuple[int, int]], Array, Array]:
    """Return pairs of coordinates, their unit velocities added and subtracted, and where slopes look, in steps.

    What is quadratic in velocities is known from its values at sums and differences of unit vectors.
    """
    unit = np.eye(masses)
    pairs = [(row, column) for row in range(masses) for column in range(row, masses)]
    speeds = np.stack([unit[i] + sign * unit[j] for sign in (1, -1) for i, j in pairs], axis=1)
    return pairs, speeds, np.concatenate([np.zeros((1, masses)), *(by * unit for by in (1, -1, 2, -2))])


def steps_of(q: Array) -> Array:
    """Return by how much every coordinate is moved to find slopes."""
    spreads = [float(np.nanstd(row)) if np.isfinite(row).any() else 0.0 for row in q]
    return _STEP * np.array([spread or 1.0 for spread in spreads])


def _slope(values: Array, step: Array) -> Array:
    """Return slopes along every coordinate, from values at it, ahead and behind by one step and by two."""
    masses = step.size
    near, far = (values[1 + at : 1 + at + masses] - values[1 + at + masses :][:masses] for at in (0, 2 * masses))
    return np.asarray((8 * near - far) / (12 * step.reshape(-1, *[1] * (values.ndim - 1))))


def _slopes(energy: Callable[[Array], Array], q: Array) -> Array:
    """Return the slopes of an energy along every coordinate, by differences of fourth order."""
    found = []
    for mass, size in enumerate(steps_of(q)):
        step = np.zeros((len(q), 1))
        step[mass] = size
        near = energy(q + step) - energy(q - step)
        far = energy(q + 2 * step) - energy(q - 2 * step)
        found.append((8 * near - far) / (12 * step[mass]))
    return np.stack(found)
