"""Constants of trials and coupled masses, slowly in NumPy: normal equations of all rows, without the noise of the regressors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from reference import weak_form

Array = npt.NDArray[np.float64]
Entry = tuple[int, int | None, int, float]

_ROUNDS = 12


def constants(  # noqa: C901 - loops, as the equations are written
    trials: Sequence[tuple[Array, Array]],
    elements: Sequence[Sequence[Entry]],
    function: tuple[int, int],
    delta: float,
    noise: tuple[Sequence[float], Sequence[float]],
    weights: Sequence[Array] | None = None,
) -> Array:
    """Give the values of elements that are constant and shared by all trials.

    A trial is its angles, shape (channels, n), and torques, shape (equations, n). An entry of an element says in which equation the
    derivative of which angle is multiplied with it, and by what more; a coefficient of None is an offset. Equations are weighted by the
    variance of their noise, which depends on the values: so both are found in turn. Weights of samples, by trial, multiply rows by
    their roots; the noise is then that of a sample of weight one.
    """
    half, exponent = function
    kernel = weak_form.kernels(half, exponent, delta)
    equations = trials[0][1].shape[0]
    values: Array = np.zeros(len(elements))
    scales = np.ones(equations)
    for _ in range(_ROUNDS):
        normal, side = np.zeros((len(elements),) * 2), np.zeros(len(elements))
        for number, (angles, torques) in enumerate(trials):
            built = [weak_form.rows(angle, torques[0], half, exponent, delta)[0] for angle in angles]
            for equation in range(equations):
                rhs = weak_form.rows(angles[0], torques[equation], half, exponent, delta)[1]
                columns = np.zeros((rhs.size, len(elements)))
                blurred = np.zeros((len(elements), len(angles), kernel.shape[1]))
                for place, entries in enumerate(elements):
                    for one, coefficient, channel, factor in entries:
                        if one != equation:
                            continue
                        if coefficient is None:
                            columns[:, place] += factor
                        else:
                            columns[:, place] += factor * built[channel][:, coefficient]
                            blurred[place, channel] += factor * kernel[coefficient]
                there = np.isfinite(columns).all(axis=1) & np.isfinite(rhs)
                roots = (
                    np.ones(rhs.size) if weights is None else weak_form.roots(weights[number], half, exponent, delta)
                )
                A, b = (roots[:, np.newaxis] * columns)[there], (roots * rhs)[there]
                added = np.einsum("ick,jck,c->ij", blurred, blurred, np.asarray(noise[0]))
                normal += scales[equation] ** 2 * (A.T @ A - len(A) * added)
                side += scales[equation] ** 2 * (A.T @ b)
        values = np.asarray(np.linalg.solve(normal, side), np.float64)
        for equation in range(equations):
            mixed = np.zeros((trials[0][0].shape[0], kernel.shape[1]))
            for value, entries in zip(values, elements, strict=True):
                for one, coefficient, channel, factor in entries:
                    if one == equation and coefficient is not None:
                        mixed[channel] += value * factor * kernel[coefficient]
            variance = noise[1][equation] * kernel[2] @ kernel[2]
            scales[equation] = 1 / np.sqrt(variance + np.sum(np.asarray(noise[0])[:, np.newaxis] * mixed**2))
    return np.asarray(values)
