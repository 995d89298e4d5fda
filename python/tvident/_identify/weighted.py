"""Weights of samples: what they are one over the variance of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Array = npt.NDArray[np.float64]

MOST_OF_FIRST: Final = 1e100
"""Times the first weight of a recording that others may be: sums of squares stay within the range of doubles."""

_MOST_AROUND: Final = 2.0
"""Times a sample's own variance that the mean of the samples around it may be, for what these predict to be compared with it."""


@dataclass(frozen=True)
class Weights:
    r"""Weights of the samples of records.

    Parameters
    ----------
    given : ndarray, shape (\\*, n)
        In any unit, near one. A sample of weight zero is missing.
    """

    given: Array

    @cached_property
    def values(self) -> Array:
        """Weights whose mean is one in every record, that of samples that count."""
        counted = self.given > 0
        with np.errstate(under="ignore"):
            means = self.given.sum(axis=-1, keepdims=True) / np.maximum(counted.sum(axis=-1, keepdims=True), 1)
            relative = self.given / np.where(means > 0, means, 1)
        return np.where(self._alike & counted, 1.0, relative)

    @cached_property
    def of_first(self) -> Array:
        """Weights over the first that is not zero, which a stream knows as well."""
        place = np.argmax(self.given > 0, axis=-1, keepdims=True)
        first = np.take_along_axis(self.given, place, axis=-1)
        with np.errstate(under="ignore", over="ignore", divide="ignore", invalid="ignore"):
            relative = self.given / np.where(first > 0, first, 1)
        is_far = self.given.max(axis=-1, keepdims=True) > MOST_OF_FIRST * first
        return np.where(is_far, self.values, relative)

    @property
    def _alike(self) -> npt.NDArray[np.bool_]:
        """Of which records all weights are alike that are not zero."""
        greatest = self.given.max(axis=-1, keepdims=True)
        return np.asarray(np.where(self.given > 0, self.given, greatest).min(axis=-1, keepdims=True) == greatest)

    def of_core(self, *, strong: bool, propagate: bool) -> Array | None:
        """Return the weights as the core asks for them; None where all are alike, which costs nothing and keeps every bit.

        Parameters
        ----------
        strong : bool
            In strong form they have the bits that a stream gives them.
        propagate : bool
            The core is to know which samples are left out rather than missing.
        """
        if not propagate and self._alike.all():
            return None
        return np.ascontiguousarray(self.of_first if strong else self.values)

    def roots(self, length: int) -> Array:
        """Return what residuals of the samples of a record are multiplied by to have the same noise.

        A residual has the noise of its sample, and that of the prediction: of the samples in a window of so many. NaN where that is far
        more: such a prediction says nothing of the sample.
        """
        counted = self.values > 0
        own = np.where(counted, 1 / np.where(counted, self.values, 1.0), 0.0)
        sums, there = (np.concatenate([[0.0], np.cumsum(one)]) for one in (own, counted))
        places, half = np.arange(own.size), length // 2
        first, end = np.maximum(places - half, 0), np.minimum(places + half + 1, own.size)
        around = (sums[end] - sums[first]) / np.maximum(there[end] - there[first], 1)
        variance = np.where(around > _MOST_AROUND * own, np.nan, np.maximum(own, around))
        return np.asarray(1 / np.sqrt(np.where(counted, variance, 1.0)))

    @property
    def spread(self) -> list[float]:
        """Variance of white noise over that of a sample of mean weight, of every record."""
        records = self.values.reshape(-1, self.values.shape[-1])
        return [float(np.mean(1 / one[one > 0])) if one.any() else 1.0 for one in records]

    def part(self, place: Any) -> Weights:
        """Return those of some records."""
        return Weights(self.given[place])


def weights_of(given: npt.ArrayLike | None, shape: tuple[int, ...]) -> Weights | None:
    """Return weights of records of some shape, or None.

    Raises
    ------
    ValueError
        If weights are no weights of the samples.
    TypeError
        If they are no numbers.
    """
    if given is None:
        return None
    is_one = arguments.any_array("weights", given).ndim == 1
    found = np.broadcast_to(_checked(given, shape[-1:] if is_one else shape), shape)
    with np.errstate(under="ignore"):
        # Sums of weights may be beyond doubles: powers of two bring the greatest near one, without rounding.
        return Weights(np.ldexp(found, -np.frexp(found.max(axis=-1, keepdims=True))[1]))


def usable_channels(
    channels: Mapping[str, npt.NDArray[np.number]],
    torques: npt.NDArray[np.number],
    weights: Weights | None,
    policy: str,
) -> tuple[dict[str, npt.NDArray[np.number]], npt.NDArray[np.number]]:
    """Return channels of the motion and the torque, what has no weight missing, with a policy for values that are missing anyway.

    Raises
    ------
    ValueError
        If values are missing that must not be, or samples have weights and no angle was measured: noise that is integrated stays.
    """
    if weights is not None and "angle" not in channels:
        source = next(iter(channels))
        raise ValueError(
            f"weights need an angle: the noise of a {source} stays in the angle that it is integrated to; got weights and no angle; "
            "measure the angle, too, or leave the weights out"
        )
    every = {**channels, "torque": torques}
    counted = None if weights is None else weights.given > 0
    for name, samples in every.items():
        one = samples if counted is None else np.where(counted, samples, 0)
        arguments.check_nan(name, one, policy, arguments.RowPolicy)
        if counted is not None and not counted.all():
            every[name] = np.where(counted, samples, np.nan)
    return {name: every[name] for name in channels}, every["torque"]


def _checked(given: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
    found = arguments.weights("weights", given, shape)
    assert found is not None  # noqa: S101 - they were given
    return found
