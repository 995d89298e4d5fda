"""A first look at coupled masses: what terms leave of their equations of given lengths, in blocks in which what changes is free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._equation import BUILT_IN
from tvident._identify.blocks import products, solved, without
from tvident._identify.first_look import FirstLook
from tvident._merged import Link, Masses, MergedIdentification, Part, TermValues, between
from tvident._results import kernels_of, touched_by

Array = npt.NDArray[np.float64]

Acting: TypeAlias = tuple[str, Link]
"""A term, and what it acts between."""

SOUGHT = tuple(name for name, one in BUILT_IN.items() if one.is_sought and (one.dissipates or one.spring == "beside"))
"""What is looked for: friction, and springs that harden, as the core does where torques act."""

_WINDOWS = 4
"""Windows at hand, and lengths of a test function, in a block at least."""

_BLOCKS = 14
"""Blocks that the longest trial has at least."""

_AT_ONCE = 4096
"""Equations whose samples are copied at once."""

_WORTH = 0.97
"""The part of what is left that a term leaves at most to be tried in full: right ones left .916 to .993, others .988 and more."""

_EACH = 8
"""Equations for each length of a test function."""


@dataclass(frozen=True)
class LookAtMasses:
    """Equations of a chain in which something changes, or on whose masses no torque acts.

    Parameters
    ----------
    found : MergedIdentification
        What is known of it.
    part : Part
        Its equations, which share unknowns.
    masses : sequence of Masses
        Of every trial.
    values : TermValues
    """

    found: MergedIdentification
    part: Part
    masses: Sequence[Masses]
    values: TermValues

    def seen(self) -> list[Acting]:
        """Return what is seen, the most first."""
        if self._products is None:
            return []
        look = FirstLook(self._left, _WORTH)
        names = [str(place) for place in range(len(self._candidates))]
        return [self._candidates[int(one)] for one in look.seen(names)] if look.tells else []

    def _left(self, names: tuple[str, ...]) -> float:
        """Return what is left with some candidates; infinite where one of them would drive the motion."""
        assert self._products is not None  # noqa: S101 - for mypy
        chosen = [int(one) for one in names]
        constant = [place for place in range(len(self._unknown)) if place not in self._windowed]
        first = len(self._unknown) + len(self._windowed)
        left, factors = solved(self._products, [*constant, *(first + one for one in chosen)])
        for one, value in zip(chosen, factors[len(constant) :], strict=True):
            if value < 0 and BUILT_IN[self._candidates[one][0]].dissipates:
                return np.inf
        return left

    @cached_property
    def _candidates(self) -> list[Acting]:
        """What may be missing: of the motion of each mass, and of that between two."""
        structure: Any = self.masses[0].structure
        alone = [("base", mass) for mass in range(structure.masses)] if structure.base is None else []
        links = dict.fromkeys([*structure.springs, *structure.dampers, *alone])
        equations = self.part.equations
        own = {
            (one.of, ("base", equations.numbers[one.entries[0][0]])) for one in equations.elements if one.of in SOUGHT
        }
        given = own | set(structure.terms)
        return [(name, link) for link in links for name in SOUGHT if (name, link) not in given]

    @property
    def _unknown(self) -> list[Any]:
        return [one for one in self.part.equations.elements if not one.is_known]

    @cached_property
    def _windowed(self) -> list[int]:
        return [place for place, one in enumerate(self._unknown) if self.found.kinds[one.name] == "windowed"]

    @cached_property
    def _kernels(self) -> Array:
        """A test function of more than twice the length at hand, and its derivatives."""
        found = self.part.found
        return kernels_of(found.window_length, found.exponent, 1 / self.found.settings["sample_rate"])

    @cached_property
    def _products(self) -> Array | None:
        """Products of the columns of what blocks leave: unknowns, slopes of what is windowed, candidates, torques."""
        found, stride = self.part.found, max(1, self._kernels.shape[1] // _EACH)
        block = _WINDOWS * max(self._kernels.shape[1], found.regression_window if self._windowed else 0)
        longest = max(trial[0].shape[1] for trial in self.part.equations.trials)
        times = max(1, min(block, longest // _BLOCKS) // stride)
        each = [self._rows(trial, stride) for trial in range(len(self.masses))]
        whole = [rows[: len(rows) // times * times] for rows in each]
        rows = np.concatenate([self._with_slopes(one, times) for one in whole])
        made = products(rows.reshape(1, -1, rows.shape[-1]), times * rows.shape[1])
        if made is None:
            return None
        slopes = range(len(self._unknown), len(self._unknown) + len(self._windowed))
        return np.asarray(without(made[0][0], [*self._windowed, *slopes]).sum(axis=0))

    def _with_slopes(self, rows: Array, times: int) -> Array:
        """Return equations in which what is windowed may change along every block."""
        later = (np.arange(len(rows)) % times - (times - 1) / 2) / times
        slopes = later[:, np.newaxis, np.newaxis] * rows[:, :, self._windowed]
        count = len(self._unknown)
        return np.concatenate([rows[:, :, :count], slopes, rows[:, :, count:]], axis=2)

    def _rows(self, trial: int, stride: int) -> Array:
        """Return weighted equations of a trial, shape (times, equations, columns): unknowns, candidates, torques without what is known."""
        equations, kernels = self.part.equations, self._kernels
        angles, torques, terms, mask, *_ = equations.trials[trial]
        beside, acting = [] if terms is None else list(terms), self._acting(self.masses[trial])
        lost = ~np.isfinite(np.stack([*angles, *torques, *beside, *acting])).all(axis=0)
        touched = touched_by(lost if mask is None else lost | ~mask, kernels.shape[1] // 2)
        half = kernels.shape[1] // 2
        usable = ~touched[half : touched.size - half : stride]
        motion = [_averages(one, kernels, stride) for one in angles]
        given, recorded, acts = (
            [_averages(one, kernels[2:], stride)[0] for one in several] for several in (beside, torques, acting)
        )
        unknown = {one.name: place for place, one in enumerate(self._unknown)}
        rows = np.zeros((usable.size, len(equations.numbers), len(unknown) + len(acting) + 1))
        rows[:, :, -1] = np.stack(recorded, axis=1)
        for element in equations.elements:
            for equation, of, channel, factor in element.entries:
                column = factor * (given[channel] if of is None else motion[channel][of])
                if element.is_known:
                    rows[:, equation, -1] -= element.number * column
                else:
                    rows[:, equation, unknown[element.name]] += column
        for place, (_, link) in enumerate(self._candidates):
            for end, sign in zip(link, (-1.0, 1.0), strict=True):
                if end != "base" and end in equations.numbers:
                    rows[:, list(equations.numbers).index(end), len(unknown) + place] = sign * acts[place]
        return rows * usable[:, np.newaxis, np.newaxis] / self._noise[:, np.newaxis]

    def _acting(self, masses: Masses) -> list[Array]:
        """Return candidates at every sample."""
        links = list(dict.fromkeys(link for _, link in self._candidates))
        motion = self.values.motion(np.stack([between(link, masses.angles, masses.count) for link in links]))
        of_links = dict(zip(links, zip(*motion, strict=True), strict=True))
        return [np.asarray(BUILT_IN[name].function(np, *of_links[link]), np.float64) for name, link in self._candidates]

    @cached_property
    def _noise(self) -> Array:
        """The standard deviation of the noise of every equation."""
        of_angles, of_torques = (np.array(one, np.float64) for one in self.part.found.noise)
        kernels = self._kernels
        acts = np.zeros((of_torques.size, of_angles.size, kernels.shape[1]))
        for element in self.part.equations.elements:
            value = element.number if element.is_known else self.found.value(element.name).value
            for equation, of, channel, factor in element.entries:
                if of is not None and np.isfinite(value):
                    acts[equation, channel] += value * factor * kernels[of]
        variance = of_torques * (kernels[2] @ kernels[2]) + np.einsum("ecs,ecs,c->e", acts, acts, of_angles)
        return np.sqrt(np.where(variance > 0, variance, np.inf))


def _averages(values: Any, kernels: Array, stride: int) -> Array:
    """Return averages of a channel, a row for each kernel, over every so many samples; what is missing is zero."""
    there = np.nan_to_num(np.asarray(values, np.float64))
    # A mean that is not zero would cost digits.
    mean = float(there.mean())
    samples = np.lib.stride_tricks.sliding_window_view(there - mean, kernels.shape[1])[::stride]
    found = np.empty((len(kernels), len(samples)))
    for first in range(0, len(samples), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        found[:, some] = kernels @ samples[some].T
    return np.asarray(found + mean * kernels.sum(axis=1, keepdims=True), np.float64)
