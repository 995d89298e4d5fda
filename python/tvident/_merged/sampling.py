"""When samples were taken: at a uniform rate, or at times that had to be brought onto a uniform grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._clocks import Clock, Grid, Passed, Timed, clock_of
from tvident._merged.weighted import spread

Numbers = npt.NDArray[np.number]

_FEWEST = 3
"""Samples of a trial: fewer have no second difference."""

_LEAST = 25
"""Samples that tell noise, at least."""


def check_lengths(samples: Sequence[int]) -> None:
    """Refuse trials that are too short for an acceleration."""
    short = next((count for count in samples if count < _FEWEST), None)
    if short is not None:
        raise ValueError(f"trials must hold at least {_FEWEST} samples each; got one of {short}; leave it out")


@dataclass(frozen=True)
class Sampling:
    """When the samples of channels were taken.

    Parameters
    ----------
    period : float
        Seconds from one sample to the next.
    start : float
        Time of the first sample in seconds.
    clock : Clock, optional
        How channels are brought onto a grid; None where they are not.
    passed : Passed, optional
        What that makes of white noise.
    workers : int, optional
    bridges : Timed, optional
        How short gaps were bridged; None where none were.
    questions : sequence of str
        What cannot be known of the samples.
    said : sequence of str
        What was done with them.
    """

    period: float
    start: float = 0.0
    clock: Clock | None = None
    passed: Passed | None = None
    workers: int | None = None
    bridges: Timed | None = None
    questions: Sequence[str] = ()
    said: Sequence[str] = ()

    @classmethod
    def of_grid(
        cls, grid: Grid, angles: Sequence[Numbers], torques: Sequence[Numbers], workers: int | None
    ) -> Sampling:
        """Return how channels whose times are not uniform are brought onto a grid."""
        channels = {"angle": np.stack(angles), "torque": np.stack(torques)}
        clock = clock_of(grid, channels, None, workers)
        passed = clock.evened({}, propagate=False, workers=workers).passed
        return cls(clock.period, grid.start, clock, passed, workers)

    @property
    def doubt(self) -> str:
        """What is wrong with the times; empty where nothing is."""
        return "" if self.clock is None else self.clock.doubt

    @property
    def words(self) -> str:
        """What was done; empty where nothing was."""
        done = self.clock if self.bridges is None else self.bridges
        return "" if done is None else done.words

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep."""
        done = self.clock if self.bridges is None else self.bridges
        return {} if done is None else done.settings

    @property
    def of_result(self) -> Sampling:
        """The times of what was found, without how they came about."""
        return replace(self, clock=None, passed=None, bridges=None, questions=(), said=())

    def times(self, samples: int) -> npt.NDArray[np.float64]:
        """Return the times of samples in seconds."""
        return self.start + self.period * np.arange(samples, dtype=np.float64)

    def channel(self, values: Numbers) -> Numbers:
        """Return a channel on the grid."""
        if self.clock is None:
            return values
        return self.clock.evened({"": values}, propagate=False, workers=self.workers).channels[""]

    def known(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return what is known at every sample on the grid, along straight lines."""
        if self.clock is None:
            return values
        found = self.clock.evened({}, propagate=False, workers=self.workers).known(values)
        return np.asarray(found, np.float64)

    def mask(self, mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Return where on the grid the samples on both sides may be used."""
        if self.clock is None:
            return mask
        found = self.clock.evened({}, propagate=False, workers=self.workers).mask(mask)
        return mask if found is None else found

    def weights(self, weights: npt.NDArray[np.float64] | None) -> npt.NDArray[np.float64] | None:
        """Return the weights of samples on the grid, where there are any."""
        if self.clock is None or weights is None:
            return weights
        return self.clock.evened({}, propagate=False, workers=self.workers).weights(weights, propagate=False)


def variances(channels: Sequence[Numbers], passed: Passed | None) -> list[float]:
    """Return the variance of the noise of every channel; NaN of those that are too short to tell, or of which too little is there."""
    noise = None if passed is None else passed.noise
    return [_variance(np.asarray(channel), noise) for channel in channels]


def mean_variance(found: Sequence[float], channels: Sequence[Numbers]) -> float:
    """Return the mean of variances that channels of several trials tell, by their samples; 0 where none tells any."""
    told = {place: np.isfinite(channels[place]).sum() for place, one in enumerate(found) if np.isfinite(one)}
    return float(np.average([found[place] for place in told], weights=list(told.values()))) if told else 0.0


def variance_in_trials(
    channels: Sequence[Numbers | None], weights: Sequence[npt.NDArray[np.float64] | None], passed: Passed | None
) -> float:
    """Return the variance of a channel's noise of a sample of weight one: the mean of trials, from one to the next of which it jumps.

    Parameters
    ----------
    channels : sequence of ndarray, shape (n,), or None
        None where a trial lacks it.
    weights : sequence of ndarray, shape (n,), or None
        Of the samples of each trial.
    passed : Passed, optional
    """
    there = [
        (np.asarray(one), spread(weight)) for one, weight in zip(channels, weights, strict=True) if one is not None
    ]
    each = [channel for channel, _ in there]
    found = [one / by for one, (_, by) in zip(variances(each, passed), there, strict=True)]
    return mean_variance(found, each)


def _variance(channel: Numbers, noise: _core.PassedNoise | None) -> float:
    return float(_core.noise(channel, None, noise)[0].sigma ** 2) if channel.size >= _LEAST else np.nan
