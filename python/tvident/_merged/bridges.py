"""Short gaps of trials and masses, which splines go over, and the noise of the channels that they leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._clocks import Bridged, bridged
from tvident._merged.masses import Masses
from tvident._merged.sampling import mean_variance, variances
from tvident._merged.trials import Trials
from tvident._merged.weighted import spread

Numbers = npt.NDArray[np.number]


@dataclass(frozen=True)
class Bridges:
    """What bridging the short gaps of trials makes of their channels.

    Parameters
    ----------
    channels : sequence of sequence of (ndarray or None)
        By trial; None was not measured.
    noise : sequence of float
        Variance of the noise of every channel, that of a sample of weight one: the mean of all trials.
    said : mapping of int to Bridged
        What was done, by the trials that had such gaps.
    """

    channels: Sequence[Sequence[Numbers | None]]
    noise: Sequence[float]
    said: Mapping[int, Bridged]

    @property
    def words(self) -> str:
        """What was done."""
        first = next(iter(self.said))
        if len(self.channels) == 1:
            return self.said[first].words
        more = len(self.said) - 1
        others = f", and likewise in {more} more of {len(self.channels)} trials" if more else ""
        return f"in trial {first} {self.said[first].words}{others}"

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep: of one trial, as every other has its own."""
        return self.said[0].settings if len(self.channels) == 1 else {}


def trials_over_gaps(
    trials: Trials, earlier: Mapping[str, Any] | None, workers: int | None
) -> tuple[Trials, Bridges | None]:
    """Return trials of one mass with their short gaps bridged, and what was done; None where nothing was.

    Parameters
    ----------
    trials : Trials
    earlier : mapping, optional
        Settings of an earlier result: what they say of bridges is done.
    workers : int, optional
    """
    weights = [None] * len(trials.angles) if trials.weights is None else trials.weights
    found = _bridges_of(list(zip(trials.angles, trials.torques, strict=True)), weights, earlier, workers)
    if found is None:
        return trials, None
    angles, torques = ([one for trial in found.channels if (one := trial[place]) is not None] for place in (0, 1))
    angle, torque = found.noise
    return replace(trials, angles=angles, torques=torques, noise=([angle], [torque])), found


def masses_over_gaps(
    trials: Sequence[Masses], earlier: Mapping[str, Any] | None, workers: int | None
) -> tuple[Sequence[Masses], Bridges | None]:
    """Return the masses of trials likewise."""
    found = _bridges_of(
        [[*one.angles, *one.torques] for one in trials], [one.weights for one in trials], earlier, workers
    )
    if found is None:
        return trials, None
    count = len(trials[0].angles)
    new = []
    for one, channels in zip(trials, found.channels, strict=True):
        angles = [channel for channel in channels[:count] if channel is not None]
        new.append(replace(one, angles=angles, torques=channels[count:], variances=found.noise))
    return new, found


def _bridges_of(
    trials: Sequence[Sequence[Numbers | None]],
    weights: Sequence[npt.NDArray[np.float64] | None],
    earlier: Mapping[str, Any] | None,
    workers: int | None,
) -> Bridges | None:
    """Return the channels of trials with their short gaps bridged; None where there are none, or they are better left out."""
    there = [{place: one for place, one in enumerate(trial) if one is not None} for trial in trials]
    found = [bridged({str(place): one for place, one in trial.items()}, earlier, workers) for trial in there]
    said = {place: one for place, one in enumerate(found) if one is not None}
    if not said:
        return None
    channels: list[list[Numbers | None]] = []
    told: list[tuple[list[float], list[Numbers]]] = [([], []) for _ in trials[0]]
    for trial, (given, over) in enumerate(zip(there, found, strict=True)):
        new = given if over is None else {place: over.channels[str(place)] for place in given}
        channels.append([new.get(place) for place in range(len(trials[trial]))])
        for place, one in new.items():
            passed = None if over is None else over.passed.get(str(place))
            told[place][0].append(variances([one], passed)[0] / spread(weights[trial]))
            told[place][1].append(one)
    return Bridges(channels, [mean_variance(*one) for one in told], said)
