"""Which elements only noise tells from each other: there is as much noise as motion in a combination of them.

A motion at one frequency makes the regressors of inertia and stiffness proportional; two masses that move at two frequencies do the same
for whole matrices. Combinations of columns of which half or more is what noise of the known variance leaves are lost, and with them
every element that takes part. Windowed elements are eliminated first, window by window; they are lost where the constants beside them are,
or where windows by themselves cannot tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._merged.merging import Part
from tvident._results import correlated_with, kernels_of, touched_by

Array: TypeAlias = npt.NDArray[np.float64]

_MOSTLY_NOISE = 0.5
"""Noise in a combination, over all of it, from which on the combination is lost."""

_PART = 0.001
"""Of an element's square in combinations that are lost, from which on it is: 3 % of their error is its own."""

_MOST = 0.5
"""The part of windows from which on those by themselves do not tell an element."""

_OVERLAP = 6
"""Rows within the half-width of a test function."""

_NAMED = 2
"""Other elements that a reason names."""


_LEAST = 1e-12
"""The variance of the noise of an equation, over that of another, below which it is none: the core's bound."""


@dataclass(frozen=True)
class _WindowsOfPart:
    """Sums over windows, constants last."""

    products: Array
    noise: Array
    squares: Array
    follow: Array
    alone: Array


@np.errstate(all="ignore")  # large numbers may leave the range of doubles
def undetermined(part: Part, period: float) -> dict[str, str]:
    """Return the elements of a part that only noise tells from others, and why.

    Parameters
    ----------
    part : Part
    period : float
        Seconds from one sample to the next.
    """
    kinds = {part.names[one.element]: one.kind for one in part.found.elements}
    windowed = [name for name, kind in kinds.items() if kind == "windowed"]
    # A sum of functions may be a constant.
    constant = [name for name, kind in kinds.items() if kind != "windowed"]
    names = [*windowed, *constant]
    rows, noises = _rows(part, names, period)
    length = part.found.regression_window if windowed else rows[0].shape[1] if rows else 0
    if not rows or length < 1:
        return {}
    stride = _stride(part)
    found = _in_windows(rows, noises, len(windowed), max(length // stride, 1))
    scale = np.sqrt(np.maximum(found.squares, np.finfo(float).tiny))
    lost = _lost(found.products, found.noise, scale[len(windowed) :])
    both = np.concatenate(
        [-(found.follow * scale[: len(windowed), np.newaxis]) @ (lost / scale[len(windowed) :, np.newaxis]), lost]
    )
    shared = _projection(both)
    within = f" within windows of {length} samples" if windowed else ""
    reasons = {}
    for place, name in enumerate(names):
        own = place < len(windowed) and found.alone[place, place] > _MOST
        if not own and shared[place, place] <= _PART:
            continue
        with_others = np.abs(shared[place])
        if own:
            with_others[: len(windowed)] = np.maximum(with_others[: len(windowed)], np.abs(found.alone[place]))
        with_others[place] = 0.0
        order = [names[one] for one in np.argsort(-with_others)[:_NAMED] if with_others[one] > 0]
        reasons[name] = (
            f"the motion tells it from {' and '.join(order) or 'nothing'}{within} by no more than noise: move at more frequencies, "
            "give one of them, or tie them"
        )
    return reasons


def _median(values: Array) -> float:
    there = values[np.isfinite(values)]
    return float(np.median(there)) if there.size else float("nan")


def _stride(part: Part) -> int:
    return max(part.found.window_length // 2 // _OVERLAP, 1)


def _rows(part: Part, names: list[str], period: float) -> tuple[list[Array], Array]:
    """Return the weighted rows of every equation of every trial, shape (elements, times), and what noise adds to the products of one."""
    equations, found = part.equations, part.found
    half, kernels = found.window_length // 2, kernels_of(found.window_length // 2, found.exponent, period)
    gram = np.array([[float(one @ other) for other in kernels] for one in kernels])
    angles, torques = (np.asarray(one, np.float64) for one in found.noise)
    count, channels = len(torques), len(angles)
    # By how much of each kernel the noise of each angle enters each equation, by element.
    enters = {one.name: np.zeros((count, channels, 3)) for one in equations.elements}
    for one in equations.elements:
        for equation, of, channel, factor in one.entries:
            if of is not None:
                enters[one.name][equation, channel, of] += factor
    values = {part.names[one.element]: _median(one.values) for one in found.elements}
    values |= {one.name: one.number for one in equations.elements if one.is_known}
    mixed = sum(
        (value * enters[name] for name, value in values.items() if np.isfinite(value)), np.zeros((count, channels, 3))
    )
    of_rows = torques * gram[2, 2] + np.einsum("c,eci,ij,ecj->e", angles, mixed, gram, mixed)
    # Parameters that are drawn to zero where no force acts leave no noise of their equation.
    weights = 1 / np.sqrt(np.maximum(of_rows, max(_LEAST * of_rows.max(initial=0.0), np.finfo(float).tiny)))
    each = np.stack([enters[name] for name in names]) * weights[:, np.newaxis, np.newaxis]
    noises = np.einsum("c,aeci,ij,becj->eab", angles, each, gram, each)
    rows, stride = [], _stride(part)
    for trial in equations.trials:
        terms = [] if trial[2] is None else [np.asarray(one, np.float64) for one in trial[2]]
        samples = np.stack([*np.asarray(trial[0], np.float64), *terms])
        is_number = np.abs(samples) <= arguments.LARGEST  # as the core sees it
        samples = np.where(is_number, samples, 0.0)
        motion = [correlated_with(one, kernels) for one in samples[: len(trial[0])]]
        averages = [correlated_with(one, kernels[2:])[0] for one in samples[len(trial[0]) :]]
        there = is_number.all(axis=0)
        usable = ~touched_by(np.asarray(~there), half)
        wanted = slice(half, None, stride)
        columns = np.zeros((count, len(names), usable[wanted].size))
        for element in equations.elements:
            if element.name in names:
                for equation, of, channel, factor in element.entries:
                    regressor = averages[channel] if of is None else motion[channel][of]
                    columns[equation, names.index(element.name)] += weights[equation] * factor * regressor[wanted]
        rows += list(columns * usable[wanted])
    return rows, np.tile(noises, (len(equations.trials), 1, 1))


def _in_windows(rows: list[Array], noises: Array, windowed: int, length: int) -> _WindowsOfPart:
    """Return the products of constants without what windows follow, and whether windows tell their own elements apart."""
    size = rows[0].shape[0]
    places = [*range(windowed), *range(windowed), *range(windowed, size)]
    grows = np.array([0.0] * windowed + [1.0] * windowed + [0.0] * (size - windowed))
    local, constants = slice(0, 2 * windowed), slice(2 * windowed, None)
    products, noise = np.zeros((2, size - windowed, size - windowed))
    squares, follow, alone = np.zeros(size), np.zeros((windowed, size - windowed)), np.zeros((windowed, windowed))
    windows = range(0, max(row.shape[1] for row in rows), length)
    counted = 0
    for first in windows:
        both, added = np.zeros((2, len(places), len(places)))
        for row, one in zip(rows, noises, strict=True):
            here = row[:, first : first + length]
            later = np.linspace(-1, 1, here.shape[1])
            powers = np.where(grows[:, np.newaxis] > 0, later, 1.0) * here[places].any(axis=0)
            columns = here[places] * powers
            both += columns @ columns.T
            added += one[np.ix_(places, places)] * (powers @ powers.T)
        squares += np.diagonal(both)[[*range(windowed), *range(2 * windowed, len(places))]]
        taken = np.linalg.pinv(both[local, local], hermitian=True) @ both[local, constants]
        products += both[constants, constants] - both[constants, local] @ taken
        crossed = added[constants, local] @ taken
        noise += added[constants, constants] - crossed - crossed.T + taken.T @ added[local, local] @ taken
        follow += taken[:windowed]
        scale = np.sqrt(np.maximum(np.diagonal(both[local, local]), np.finfo(float).tiny))
        alone += _projection(_lost(both[local, local], added[local, local], scale))[:windowed, :windowed]
        counted += 1
    return _WindowsOfPart(products, noise, squares, follow / counted, alone / counted)


def _lost(products: Array, noise: Array, scale: Array) -> Array:
    """Return the combinations of scaled columns that are mostly noise, one a column."""
    both = np.outer(scale, scale)
    if not len(scale) or not np.isfinite([products / both, noise / both]).all():
        return np.zeros((len(scale), 0))
    values, vectors = np.linalg.eigh(products / both)
    whole = values > np.finfo(float).eps * len(scale) * values[-1]
    root = vectors[:, whole] / np.sqrt(values[whole])
    parts, found = np.linalg.eigh(root.T @ (noise / both) @ root)
    return np.asarray(root @ found[:, parts > _MOSTLY_NOISE])


def _projection(columns: Array) -> Array:
    """Return the projection onto the span of some columns."""
    if not columns.size:
        return np.zeros((len(columns), len(columns)))
    left, singular, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    span = left[:, singular > np.sqrt(np.finfo(float).eps)]
    return np.asarray(span @ span.T)
