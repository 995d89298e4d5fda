"""Repeated trials: records of one length or of several, and the phase that aligns them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._merged.sampling import Sampling, check_lengths
from tvident._merged.weighted import of_core, without_missing
from tvident._units import scaled

Numbers = npt.NDArray[np.number]

_PAIR = 2

_LONGEST = 1.5
"""Of a phase: trials may overlap into the next cycle, but two are none."""


@dataclass(frozen=True)
class Trials:
    """Channels of repeated trials.

    Parameters
    ----------
    angles, torques : sequence of ndarray, shape (n,)
        Lengths may differ from trial to trial.
    masks : sequence of ndarray of bool, or None
    positions : sequence of ndarray, or None
        The sample of the result that every sample belongs to.
    samples : int
        Of the result.
    phase : ndarray, shape (samples,), or None
        Of every sample of the result.
    weights : sequence of ndarray, or None
        Of every sample of a trial.
    noise : (list of float, list of float), or None
        Variances of the noise of angle and torque, where bridging gaps changed it.
    """

    angles: Sequence[Numbers]
    torques: Sequence[Numbers]
    masks: Sequence[npt.NDArray[np.bool_]] | None
    positions: Sequence[npt.NDArray[np.float64]] | None
    samples: int
    phase: npt.NDArray[np.float64] | None
    weights: Sequence[npt.NDArray[np.float64] | None] | None = None
    noise: tuple[list[float], list[float]] | None = None

    def scaled(self, angle: float, torque: float) -> Trials:
        """Return the trials with their channels times factors of units."""
        angles, torques = (
            [scaled(one, by) for one in each] for each, by in ((self.angles, angle), (self.torques, torque))
        )
        return replace(self, angles=angles, torques=torques)

    def weighted(self, weights: Sequence[npt.NDArray[np.float64]] | None) -> Trials:
        """Return the trials with weights; samples that have none are missing."""
        if weights is None:
            return self
        angles, torques = (
            [without_missing(*pair) for pair in zip(each, weights, strict=True)] for each in (self.angles, self.torques)
        )
        return replace(self, angles=angles, torques=torques, weights=of_core(weights))

    def on_grid(self, sampling: Sampling) -> Trials:
        """Return the trials with their channels on a uniform grid.

        Raises
        ------
        ValueError
            If times are not those of every trial.
        """
        if self.positions is not None or len({one.size for one in self.angles}) > 1:
            raise ValueError(
                "t must be uniform beside phase=, and beside trials of different lengths; got steps that scatter; resample each trial"
            )
        angles, torques = ([sampling.channel(one) for one in each] for each in (self.angles, self.torques))
        masks = None if self.masks is None else [sampling.mask(one) for one in self.masks]
        weights = None if self.weights is None else [sampling.weights(one) for one in self.weights]
        return replace(self, angles=angles, torques=torques, masks=masks, samples=angles[0].size, weights=weights)


def trials_of(angle: Any, torque: Any, axis: int, *, phase: Any = None, mask: Any = None) -> Trials:
    """Return trials from arrays of shape (trials, n), or from lists of records whose lengths may differ.

    Raises
    ------
    ValueError
        If there is one record only, lengths of angle and torque differ, or a phase does not grow.
    """
    angles, torques = _records("angle", angle, axis), _records("torque", torque, axis)
    check_lengths([one.size for one in angles])
    masks, phases = _masks(mask, angles), _optional("phase", phase, axis)
    for name, other in (("torque", torques), ("phase", phases), ("mask", masks)):
        if other is None:
            continue
        shapes, expected = [one.size for one in other], [one.size for one in angles]
        if len(shapes) != len(expected):
            raise ValueError(
                f"{name} must have as many trials as the angle; got {len(shapes)} beside {len(expected)}; give one a trial"
            )
        if shapes != expected:
            raise ValueError(
                f"{name} must have a sample for every sample of the angle, trial by trial; got trials of "
                f"{arguments.shown(shapes)} samples beside {arguments.shown(expected)}; cut them to the same"
            )
    if phases is None:
        return Trials(angles, torques, masks, None, max(one.size for one in angles), None)
    checked = [_growing(place, np.asarray(one, np.float64)) for place, one in enumerate(phases)]
    rates = np.concatenate([np.diff(one) for one in checked])
    samples = round(1 / float(np.median(rates)))
    inside = any(one[0] < 1 and one[-1] > 0 for one in checked)
    longest = max(float(one[-1] - one[0]) for one in checked)
    if samples < 1 or not inside or longest > _LONGEST:
        raise ValueError(
            f"phase must grow from 0 to 1 in every trial; got {checked[0][0]:g} to {checked[0][-1]:g} in the first; "
            "divide it by its period (2π, 100 %), and cut the recording into one trial a cycle"
        )
    return Trials(angles, torques, masks, [one * samples for one in checked], samples, np.arange(samples) / samples)


def _records(name: str, values: Any, axis: int) -> list[Numbers]:
    """Return the records along an axis of an array, or those of a list."""
    if isinstance(values, Sequence) and not isinstance(values, str) and len({np.size(one) for one in values}) > 1:
        if axis not in {0, -_PAIR}:
            raise ValueError(f"ensemble_axis must be 0 for a list of records; got {axis}; leave other axes to arrays")
        found = [arguments.channel(name, one) for one in values]
    else:
        array = arguments.channel(name, values)
        if array.ndim != _PAIR:
            raise ValueError(
                f"{name} must have shape (trials, n) beside ensemble_axis=, or be a list of records; got {array.shape}; "
                "add dof_axis=1 where trials are of several masses, and identify batches one at a time"
            )
        if axis not in {0, -_PAIR}:
            raise ValueError(
                f"ensemble_axis must be the axis of the trials, 0, since time is the last; got {axis}; transpose the arrays"
            )
        found = list(array)
    if any(one.ndim != 1 for one in found):
        raise ValueError(
            f"{name} must be a list of records of shape (n,); got a trial of shape {found[0].shape}; flatten it"
        )
    if len(found) < 1:
        raise ValueError(f"{name} must hold trials; got none; give at least one")
    return found


def _optional(name: str, values: Any, axis: int) -> list[Numbers] | None:
    return None if values is None else _records(name, values, axis)


def _masks(mask: Any, angles: Sequence[Numbers]) -> list[npt.NDArray[np.bool_]] | None:
    """Return a mask for every trial; one of shape (n,) is that of all."""
    if mask is None:
        return None
    given: Any
    if isinstance(mask, Sequence) and mask and np.ndim(mask[0]) > 0:
        given = [arguments.mask("mask", one, np.shape(one)[:1]) for one in mask]
    else:
        given = arguments.mask("mask", mask, (len(angles), max(one.size for one in angles)))
    return [np.ascontiguousarray(one) for one in given]


def _growing(place: int, phase: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return a phase that grows from sample to sample."""
    steps = np.diff(phase)
    if not np.isfinite(phase).all() or not (steps > 0).all():
        wrong = int(np.flatnonzero(~(steps > 0))[0]) + 1 if (~(steps > 0)).any() else 0
        raise ValueError(
            f"phase must be finite and grow from sample to sample within a trial; got {phase[wrong]:g} after "
            f"{phase[max(wrong - 1, 0)]:g} at sample {wrong} of trial {place}; cut the recording into one trial a cycle"
        )
    return phase
