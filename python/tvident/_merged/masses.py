"""Several masses: their channels, which forces are known, and what can be told of their elements before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import Passed
from tvident._equation import COEFFICIENTS
from tvident._merged.call import AskedTogether, TermValues
from tvident._merged.elements import Element, check_expansions, kind_or_number, on_grid, renumbered, rewired, terms_of
from tvident._merged.mechanism import Mechanism
from tvident._merged.merging import Merging, Part
from tvident._merged.predicted import Equations, TrialArrays
from tvident._merged.recorded import MergedRecorded
from tvident._merged.result import MergedIdentification
from tvident._merged.sampling import Sampling, check_lengths, variance_in_trials
from tvident._merged.structure import Chain, between, matrices
from tvident._merged.weighted import without_missing
from tvident._units import scaled

Numbers = npt.NDArray[np.number]

_DEPENDENT = 0.05
"""The part of a force's mean square, beyond the noise that it may have, that others must leave of it for it to be a force of its own."""


@dataclass(frozen=True)
class Masses:
    """Channels of several masses.

    Parameters
    ----------
    angles : sequence of ndarray, shape (n,)
        One a mass, then the base where it moves.
    torques : sequence of ndarray, or None for a force that was not measured
    structure : Chain or Mechanism, optional
    mask : ndarray of bool, shape (n,), optional
    weights : ndarray, shape (n,), optional
    momenta : sequence of ndarray, shape (n,)
        Of a mechanism: channels that follow the angles.
    forces : sequence of ndarray, shape (n,)
        Of a mechanism: terms before those that were asked for.
    inertia : mapping of str to ndarray, shape (masses, masses, n)
        Of a mechanism: by how much factors enter the matrix of inertia.
    variances : sequence of float, optional
        Of the noise of the angles, then of the torques, where bridging gaps changed it.
    """

    angles: Sequence[Numbers]
    torques: Sequence[Numbers | None]
    structure: Chain | Mechanism | None
    mask: npt.NDArray[np.bool_] | None
    momenta: Sequence[npt.NDArray[np.float64]] = ()
    forces: Sequence[npt.NDArray[np.float64]] = ()
    weights: npt.NDArray[np.float64] | None = None
    inertia: Mapping[str, npt.NDArray[np.float64]] = field(default_factory=dict)
    variances: Sequence[float] | None = None

    @property
    def count(self) -> int:
        """Number of masses."""
        return len(self.torques)

    def scaled(self, angle: float, torque: float) -> Masses:
        """Return the masses with their channels times factors of units."""
        torques = [None if one is None else scaled(one, torque) for one in self.torques]
        return replace(self, angles=[scaled(one, angle) for one in self.angles], torques=torques)

    def weighted(self, weights: npt.NDArray[np.float64], of_rows: npt.NDArray[np.float64] | None) -> Masses:
        """Return the masses with weights, those of rows None where all are alike; samples that have none are missing."""
        torques = [None if one is None else without_missing(one, weights) for one in self.torques]
        return replace(
            self, angles=[without_missing(one, weights) for one in self.angles], torques=torques, weights=of_rows
        )

    def with_elements(self, asked: AskedTogether, term_values: TermValues) -> tuple[Masses, list[Element]]:
        """Return the masses with all that enters their equations, and the elements, those of terms last.

        There is one a term and mass whose force is known, zero or not: also where none acts an angle may have another zero, and a bearing
        rub.
        """
        given, place, whole = asked.parameters, 0, self
        if isinstance(self.structure, Chain):
            found, place = self.structure.elements(given), len(self.structure.terms)
        elif self.structure is None:
            found = matrices(given, self.count)
        else:
            rows = self.structure.regressors(*term_values.motion(np.stack(self.angles)))
            # Inertia, damping and stiffness are beside what energies say.
            found = [*rows.elements, *matrices({**dict.fromkeys(COEFFICIENTS, 0.0), **given}, self.count)]
            found = [one for one in found if not one.is_known or one.value]
            whole = replace(self, momenta=rows.momenta, forces=rows.forces, inertia=rows.inertia)
            place = len(rows.forces)
        for name, kind in asked.terms:
            for mass in self.measured:
                found.append(
                    Element(
                        f"{name}_{mass}", name, ((mass, None, place, 1.0),), kind_or_number(name, kind or "constant")
                    )
                )
                place += 1
        own_kinds = frozenset(self.structure.kinds) if isinstance(self.structure, Mechanism) else frozenset()
        return whole, [on_grid(one, asked.sampling) for one in asked.as_before(found, own_kinds)]

    @property
    def channels(self) -> list[Numbers]:
        """All that moves: angles, then momenta."""
        return [*self.angles, *self.momenta]

    def noise(
        self, trials: Sequence[Masses], channels: Sequence[int], equations: Sequence[int], passed: Passed | None
    ) -> tuple[list[float], list[float]] | None:
        """Return the variances of the noise of some channels and torques; None where they are to be estimated.

        They are means over trials: from one to the next channels jump. That of momenta is not known, and smoothness says nothing of it:
        they are functions of smooth velocities.
        """
        if self.variances is not None:
            known = list(self.variances[: len(self.angles)])
            torques = [self.variances[len(self.angles) + one] for one in equations]
        elif self.momenta or passed is not None:
            weights = [one.weights for one in trials]
            of_trials = zip(*(one.angles for one in trials), strict=True)
            known = [variance_in_trials(each, weights, passed) for each in of_trials]
            torques = [variance_in_trials([one.torques[mass] for one in trials], weights, passed) for mass in equations]
        else:
            return None
        return [known[one] if one < len(known) else 0.0 for one in channels], torques

    def on_grid(self, sampling: Sampling) -> Masses:
        """Return the masses with their channels on a uniform grid."""
        torques = [None if one is None else sampling.channel(one) for one in self.torques]
        mask = None if self.mask is None else sampling.mask(self.mask)
        angles = [sampling.channel(one) for one in self.angles]
        return replace(self, angles=angles, torques=torques, mask=mask, weights=sampling.weights(self.weights))

    @property
    def measured(self) -> list[int]:
        """Masses whose force is known."""
        return [mass for mass, torque in enumerate(self.torques) if torque is not None]

    @property
    def driven(self) -> list[int]:
        """Masses on which a force acts that is known."""
        return [mass for mass in self.measured if np.any(np.nan_to_num(np.asarray(self.torques[mass], np.float64)))]


def masses_of(
    angle: Any, torque: Any, axis: int, structure: Any, *, trials: int | None, mask: Any = None
) -> list[Masses]:
    """Return the masses of every trial, from arrays of shape (masses, n), (trials, masses, n), or lists of the former.

    Raises
    ------
    ValueError
        If shapes differ, or do not belong to the structure.
    TypeError
        If the structure is none.
    """
    if structure is not None and not isinstance(structure, Chain | Mechanism):
        raise TypeError(
            f"structure must be a tvident.Chain or a tvident.Mechanism; got {arguments.shown(structure)}; leave it out for full "
            "matrices, whose entries are given by tvident.Matrix"
        )
    if trials is None:
        return [_one_trial(angle, torque, axis, structure, base=getattr(structure, "base", None), mask=mask)]
    return _several_trials((angle, torque), (trials, axis), structure, mask)


def _one_trial(angle: Any, torque: Any, axis: int, structure: Any, *, base: Any, mask: Any) -> Masses:
    """Return the masses of one trial."""
    angles, torques = arguments.channels(angle=angle, torque=torque)
    if angles.ndim != 2 or axis not in {0, -2}:  # noqa: PLR2004 - masses and time
        raise ValueError(
            f"angle and torque must have shape (masses, n) with dof_axis=0; got {angles.shape} with dof_axis={axis}; transpose "
            "them, take one record of a batch, or say which axis is that of trials: ensemble_axis="
        )
    count, samples = angles.shape
    check_lengths([samples])
    each: list[Numbers] = list(angles)
    if isinstance(structure, Chain):
        if structure.masses != count:
            raise ValueError(
                f"angle must have a row for each of {structure.masses} masses of the structure; got {count} rows; "
                "give the angles of all masses"
            )
        if base is not None:
            moving = arguments.channel("base", base)
            if moving.shape != (samples,):
                raise ValueError(
                    f"the base of a chain must have shape ({samples},), as time has; got {moving.shape}; resample it"
                )
            each.append(moving)
    forces = [None if not np.isfinite(np.asarray(row, np.float64)).any() else row for row in torques]
    return Masses(each, forces, structure, None if mask is None else _mask(mask, samples))


def _several_trials(channels: tuple[Any, Any], axes: tuple[int, int], structure: Any, mask: Any) -> list[Masses]:
    """Return the masses of several trials."""
    if isinstance(structure, Mechanism):
        raise ValueError(  # noqa: TRY004 - it goes with one trial
            "trials of a Mechanism are not supported together yet; got ensemble_axis=; join them to one record, shape (masses, n), with "
            "ten columns of NaN between trials, over which nothing is bridged"
        )
    angles, torques = (_by_trial(name, one, axes) for name, one in zip(("angle", "torque"), channels, strict=True))
    if len(angles) != len(torques):
        raise ValueError(
            f"angle and torque must have the same trials; got {len(angles)} and {len(torques)}; leave out those that lack one"
        )
    one_for_all = mask is None or (not isinstance(mask, Sequence) and np.ndim(mask) == 1)
    masks = [mask] * len(angles) if one_for_all else list(mask)
    base: Any = getattr(structure, "base", None)
    bases: list[Any] = [None] * len(angles) if base is None else list(base)
    for name, several in (("mask", masks), ("the base of a chain", bases)):
        if len(several) != len(angles) or (several is bases and base is not None and np.ndim(several[0]) != 1):
            raise ValueError(
                f"{name} must have a row for each of {len(angles)} trials; got {len(several)}; give one for every trial"
            )
    found = [
        _one_trial(moves, drives, 0, structure, base=base, mask=own)
        for moves, drives, base, own in zip(angles, torques, bases, masks, strict=True)
    ]
    counts = sorted({one.count for one in found})
    if len(counts) > 1:
        raise ValueError(f"all trials must have the same masses; got {counts} rows; leave out what others lack")
    return found


def _by_trial(name: str, values: Any, axes: tuple[int, int]) -> list[Any]:
    """Return a channel of every trial, shape (masses, n)."""
    if isinstance(values, Sequence) and len({np.shape(one) for one in values}) > 1:
        if axes[0] not in {0, -3} or axes[1] not in {1, -2}:
            raise ValueError(
                "a list of trials must have ensemble_axis=0 and dof_axis=1, as an array of shape (trials, masses, n) has; got "
                f"{axes[0]} and {axes[1]}; give these"
            )
        return list(values)
    array = arguments.channel(name, values)
    three = 3
    places = [axis % three for axis in axes if -three <= axis < three]
    if array.ndim != three or sorted(places) != [0, 1]:
        raise ValueError(
            f"{name} must have shape (trials, masses, n) with ensemble_axis=0 and dof_axis=1; got {array.shape} with "
            f"ensemble_axis={axes[0]} and dof_axis={axes[1]}; transpose it"
        )
    return list(np.moveaxis(array, places[0], 0))


def _joined(trials: Sequence[Masses]) -> Masses:
    """Return trials one after the other, as far as it tells what can be known of them."""
    if len(trials) == 1:
        return trials[0]
    lengths = [one.angles[0].size for one in trials]
    torques: list[Numbers | None] = []
    for mass in range(trials[0].count):
        rows = [one.torques[mass] for one in trials]
        filled = [
            np.full(length, np.nan) if row is None else np.asarray(row, np.float64)
            for row, length in zip(rows, lengths, strict=True)
        ]
        torques.append(None if all(row is None for row in rows) else np.concatenate(filled))
    angles = [np.concatenate(channels) for channels in zip(*(one.angles for one in trials), strict=True)]
    return replace(trials[0], angles=angles, torques=torques, mask=None)


def identify_masses(trials: Sequence[Masses], asked: AskedTogether, term_values: TermValues) -> MergedIdentification:
    """Identify the elements of several masses, from one trial or from several that share them."""
    joined, elements = _joined(trials).with_elements(asked, term_values)
    several = [joined] if len(trials) == 1 else trials
    check_expansions(elements, max(one.angles[0].size for one in several), has_momenta=bool(joined.momenta))
    if all(element.is_known for element in elements):
        raise ValueError("at least one element must be unknown; all are given; use 'windowed' or 'constant' for one")
    if not joined.driven and not any(one.is_known and one.value for one in elements):
        raise ValueError(
            "a force must act on one of the masses and be measured, or one of their coefficients be given: without either everything is "
            f"known up to scale only; got torques that are all zero or missing; give one element, such as {elements[0].name}, a number"
        )
    unknowable = unknowable_of(joined, elements)
    open_ones = [one for one in elements if not one.is_known and one.name not in unknowable]
    samples = max(one.angles[0].size for one in several)
    parts: list[Part] = []
    # What is known takes part in all equations, but ties none.
    for equations in components(joined.measured, open_ones):
        inside = [one.at(equations) for one in elements if one.is_known or one in open_ones]
        inside = [one for one in inside if one.entries]
        if all(one.is_known for one in inside):
            continue
        names = dict(terms_of(inside, elements))
        order = {place: new for new, place in enumerate(names)}
        inside = [renumbered(one, order) for one in inside]
        # The angle of every equation comes first, in their order.
        channels = [*equations, *(one for one in range(len(joined.channels)) if one not in equations)]
        inside = [rewired(one, {channel: place for place, channel in enumerate(channels)}) for one in inside]
        given = [_recorded(one, equations, channels, names, term_values) for one in several]
        noise = joined.noise(trials, channels, equations, asked.sampling.passed)
        is_white = joined.variances is None or bool(joined.momenta)
        parts.append(asked.part(Equations(inside, equations, given), samples, noise, len(parts), is_white=is_white))
    if asked.earlier is not None:
        asked.earlier.check_parts(len(parts))
    merging = Merging(
        elements,
        parts,
        sampling=asked.sampling,
        step=asked.step,
        samples=samples,
        trials=len(several),
        masses=joined.count,
        units=asked.units_of(elements),
        unknowable=unknowable,
        inertia=joined.inertia,
        recorded=MergedRecorded(
            [one.angles[: one.count] for one in trials],
            [one.torques for one in trials],
            [one.angles[one.count] if len(one.angles) > one.count else None for one in trials],
            structure=joined.structure,
            own=asked.own,
        ),
        terms=[name for name, _ in asked.terms],
        kinds_of_terms=asked.kinds_of_terms,
    )
    return MergedIdentification(merging)


def _recorded(
    masses: Masses, equations: Sequence[int], channels: Sequence[int], names: Mapping[int, str], term_values: TermValues
) -> TrialArrays:
    """Return what was recorded of some equations, as the core takes it."""
    samples = masses.angles[0].size
    terms = np.stack([_term(masses, *one, term_values) for one in names.items()]) if names else None
    torques = [masses.torques[mass] for mass in equations]
    rows = [np.full(samples, np.nan) if one is None else np.asarray(one, np.float64) for one in torques]
    angles = np.stack([np.asarray(masses.channels[channel], np.float64) for channel in channels])
    return angles, np.stack(rows), terms, masses.mask, None, masses.weights


def _term(masses: Masses, place: int, name: str, term_values: TermValues) -> npt.NDArray[np.float64]:
    """Return a term of one mass, or of the motion between two, at every sample."""
    if place < len(masses.forces):
        return masses.forces[place]
    if isinstance(masses.structure, Chain) and place < len(masses.structure.terms):
        term, link = masses.structure.terms[place]
        return term_values(term, between(link, masses.angles, masses.count))
    term, mass = name.rsplit("_", 1)
    return term_values(term, masses.angles[int(mass)])


def components(equations: Sequence[int], elements: Sequence[Element]) -> list[list[int]]:
    """Return equations that share unknowns, together: each of the others can be solved alone."""
    groups: list[set[int]] = [{one} for one in equations]
    for element in elements:
        touched = [group for group in groups if group & element.equations]
        if len(touched) > 1:
            merged = set().union(*touched)
            groups = [group for group in groups if group not in touched] + [merged]
    return sorted(sorted(group) for group in groups)


def unknowable_of(masses: Masses, elements: Sequence[Element]) -> dict[str, str]:
    """Return which elements cannot be known, whatever the motion, and why."""
    found: dict[str, str] = {}
    unknown = [one for one in elements if not one.is_known]
    measured, driven = set(masses.measured), set(masses.driven)
    for element in unknown:
        missing = sorted(element.equations - measured)
        if not element.equations & measured:
            found[element.name] = (
                f"the force on mass {' and '.join(map(str, missing))} was not measured, and it appears in "
                "that equation only; measure the force"
            )
    left = [one for one in unknown if one.name not in found]
    for equations in components(masses.measured, left):
        here = [one for one in left if one.equations & set(equations)]
        # A coefficient that is known and not zero sets the scale as a force does.
        known = any(one.is_known and one.value and one.equations & set(equations) for one in elements)
        if not set(equations) & driven and not known:
            for one in here:
                found[one.name] = (
                    f"no force acts on mass {' and '.join(map(str, equations))}: its equation is known up to scale only; "
                    "apply a force, tie it to others with structure=, or give one of its coefficients"
                )
            continue
        dependent = _dependent(masses, equations) if masses.structure is None else None
        if dependent:
            for one in here:
                found[one.name] = dependent
    return found


def _finite(values: Any) -> npt.NDArray[np.float64]:
    """Return samples with zero where the core sees no number."""
    array = np.asarray(values, np.float64)
    return np.where(np.abs(array) <= arguments.LARGEST, array, 0.0)


def _dependent(masses: Masses, equations: Sequence[int]) -> str | None:
    """Return why full rows cannot be known: forces that depend on each other let one row be added to another."""
    free = {mass for mass in range(masses.count) if mass not in equations}
    if not free or len(equations) > 1:
        return None
    here = _finite(masses.torques[equations[0]])
    silent = [mass for mass in sorted(free) if mass in masses.measured and mass not in masses.driven]
    if silent:
        return (
            f"no force acts on mass {silent[0]}: any multiple of its equation can be added to that of mass {equations[0]}; as "
            "many independent forces as masses are needed for full matrices; use structure=tvident.Chain(…)"
        )
    for mass in sorted(free & set(masses.driven)):
        other = _finite(masses.torques[mass])
        # Of forces of size one: squares of large ones leave the range of doubles.
        sizes = [max(float(np.linalg.norm(one, np.inf)), np.finfo(float).tiny) for one in (here, other)]
        one, two = here / sizes[0], other / sizes[1]
        both = float(one @ two) ** 2 / max(float(one @ one) * float(two @ two), np.finfo(float).tiny)
        if 1 - both < _DEPENDENT:
            return (
                f"the forces on masses {equations[0]} and {mass} depend on each other (correlation {both**0.5:.3f}): "
                "their equations can be added; apply independent forces, or use structure=tvident.Chain(…)"
            )
    return None


def _mask(mask: Any, samples: int) -> npt.NDArray[np.bool_]:
    """Return a mask of all masses."""
    found = arguments.mask("mask", mask, (samples,))
    return np.ascontiguousarray(found)
