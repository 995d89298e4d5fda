"""Modes of a system of few masses over time: natural frequencies, damping ratios and shapes, with standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvident import _core

Real = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_MOST_TIMES = 2000
"""Times at which the eigenproblem is solved; in between, modes are interpolated."""


@dataclass(frozen=True)
class Modes:
    r"""Modes over time, the lowest frequency first at the first time, and each the same mode at all times.

    Parameters
    ----------
    natural_frequency : ndarray, shape (modes, n)
        Hz. NaN where a mode does not oscillate or is not known.
    damping_ratio : ndarray, shape (modes, n)
    shapes : ndarray of complex, shape (masses, modes, n)
        Each with its largest component one.
    natural_frequency_stderr, damping_ratio_stderr : ndarray, shape (modes, n)
        By the delta method, with all covariances of the elements.
    """

    natural_frequency: Real
    damping_ratio: Real
    shapes: Complex
    natural_frequency_stderr: Real
    damping_ratio_stderr: Real


@dataclass(frozen=True)
class ModalElement:
    """By how much an element enters the three matrices, its values over time, and its place in the covariance."""

    patterns: tuple[Real, Real, Real]
    values: Real


def times_of(samples: int) -> npt.NDArray[np.intp]:
    """Return the samples at which modes are computed."""
    return np.unique(np.linspace(0, max(samples - 1, 0), min(samples, _MOST_TIMES)).round().astype(np.intp))


def modes_of(elements: Sequence[ModalElement], covariance: Real, times: npt.NDArray[np.intp], samples: int) -> Modes:
    """Return the modes of a system.

    Parameters
    ----------
    elements : sequence of ModalElement
        Their values at all samples.
    covariance : ndarray, shape (times, elements, elements)
        Of the elements at the times at which modes are computed.
    times : ndarray, shape (times,)
        Samples.
    samples : int
        Samples between which modes are interpolated.
    """
    count = elements[0].patterns[0].shape[0]
    matrices = [
        sum(one.patterns[which] * one.values[times, np.newaxis, np.newaxis] for one in elements) for which in range(3)
    ]
    inertia, damping, stiffness = (np.asarray(one, np.float64) for one in matrices)
    found = _core.modes(inertia, damping, stiffness)
    poles, shapes, lefts = found.poles, np.swapaxes(found.shapes, 1, 2).copy(), found.lefts
    known = np.isfinite(poles).any(axis=1)
    poles[known], shapes[known], lefts[known] = _tracked(poles[known], shapes[known], lefts[known])
    frequency, ratio = np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)
    errors = _errors(elements, covariance, (poles, shapes, lefts), (inertia, damping))
    everywhere = np.arange(samples)

    def between(values: Real) -> Real:
        return np.stack([_interpolated(everywhere, times, column) for column in values.T])

    flat = shapes.reshape(times.size, -1)
    both = between(flat.real) + 1j * between(flat.imag)
    return Modes(
        between(frequency), between(ratio), both.reshape(count, count, samples), between(errors[0]), between(errors[1])
    )


def _interpolated(at: npt.NDArray[np.intp], times: npt.NDArray[np.intp], values: Real) -> Real:
    """Interpolate; what is next to something unknown is unknown."""
    return np.asarray(np.interp(at, times, values))


@np.errstate(all="ignore")  # where a mode is not known, nothing is divided
def _tracked(poles: Complex, shapes: Complex, lefts: Complex) -> tuple[Complex, Complex, Complex]:
    """Put the modes of every time in the order of those before: of the same pole and shape."""
    poles, shapes, lefts = poles.copy(), shapes.copy(), lefts.copy()
    for time in range(poles.shape[0]):
        if time:
            before, now = shapes[time - 1], shapes[time]
            alike = np.abs(before.conj().T @ now) ** 2
            alike /= np.outer(np.sum(np.abs(before) ** 2, 0), np.sum(np.abs(now) ** 2, 0))
            last = poles[time - 1]
            away = np.abs(last[:, np.newaxis] - poles[time]) / np.abs(last[:, np.newaxis])
            order = _matched(np.nan_to_num(alike, nan=0.0) - np.nan_to_num(away, nan=1.0))
            poles[time], shapes[time], lefts[time] = poles[time, order], now[:, order], lefts[time, order]
        largest = np.argmax(np.abs(shapes[time]), axis=0)
        scale = shapes[time][largest, np.arange(largest.size)]
        shapes[time] = shapes[time] / scale
        lefts[time] = lefts[time] * scale[:, np.newaxis]
    return poles, shapes, lefts


def _matched(likeness: Real) -> npt.NDArray[np.intp]:
    """Return for every mode before the one that is most like it, each once, the most certain first."""
    left, order = likeness.copy(), np.zeros(likeness.shape[0], np.intp)
    for _ in range(likeness.shape[0]):
        before, now = np.unravel_index(int(np.argmax(left)), left.shape)
        order[before] = now
        left[before, :] = -np.inf
        left[:, now] = -np.inf
    return order


@np.errstate(all="ignore")
def _errors(
    elements: Sequence[ModalElement],
    covariance: Real,
    solved: tuple[Complex, Complex, Complex],
    matrices: tuple[Real, Real],
) -> tuple[Real, Real]:
    """Return standard errors of frequencies and ratios: how poles move with every element (first-order perturbation)."""
    poles, shapes, lefts = solved
    inertia, damping = matrices
    slopes = np.empty((*poles.shape, len(elements)), np.complex128)
    own = 2 * poles[:, :, np.newaxis, np.newaxis] * inertia[:, np.newaxis] + damping[:, np.newaxis]
    right = np.swapaxes(shapes, 1, 2)
    norm = np.einsum("tmi,tmij,tmj->tm", lefts, own, right)
    for place, one in enumerate(elements):
        m, c, k = (np.einsum("tmi,ij,tmj->tm", lefts, pattern, right) for pattern in one.patterns)
        slopes[:, :, place] = -(poles**2 * m + poles * c + k) / norm
    size = np.abs(poles)[:, :, np.newaxis]
    of_size = (poles.conj()[:, :, np.newaxis] * slopes).real / size
    of_ratio = -slopes.real / size + poles.real[:, :, np.newaxis] * of_size / size**2

    def error(gradient: Real) -> Real:
        return np.asarray(np.sqrt(np.maximum(np.einsum("tmi,tij,tmj->tm", gradient, covariance, gradient), 0)))

    return error(of_size) / (2 * np.pi), error(of_ratio)


def shared(names: Sequence[str], known: Mapping[tuple[str, str], Real], size: int) -> Real:
    """Return covariances of all pairs as matrices, shape (size, names, names); zero where nothing is known of a pair."""
    found = np.zeros((size, len(names), len(names)))
    places = {name: place for place, name in enumerate(names)}
    for (one, other), values in known.items():
        if one in places and other in places:
            found[:, places[one], places[other]] = values
            found[:, places[other], places[one]] = values
    return found
