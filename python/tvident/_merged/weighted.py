"""Weights of the samples of trials, which are relative to those of all trials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.number]


def weights_of_trials(given: Any, lengths: Sequence[int], *, several: bool) -> list[Array] | None:
    """Return the weights of every trial, their mean over all samples that count one; None without any.

    Parameters
    ----------
    given : array_like, or sequence of array_like, optional
        Of shape (n,) for all trials, or one of each.
    lengths : sequence of int
        Samples of every trial.
    several : bool
        Whether there is an axis of trials.

    Raises
    ------
    ValueError
        If they are no weights of the samples.
    """
    if given is None:
        return None
    each = _by_trial(given, lengths, several=several)
    together = np.concatenate(each)
    counted = together > 0
    if not counted.any():
        arguments.weights("weights", together, together.shape)
    # The sum of large weights would leave the range of doubles.
    scale = float(together.max()) if together.max() > arguments.LARGEST else 1.0
    mean = (together[counted] / scale).mean()
    return [one / scale / mean for one in each]


def of_core(weights: Sequence[Array] | None) -> list[Array | None] | None:
    """Return weights as the core asks for them; none where all that count are alike, which costs nothing and keeps every bit."""
    if weights is None:
        return None
    counted = np.concatenate(weights)
    counted = counted[counted > 0]
    return None if counted.max() == counted.min() else [np.ascontiguousarray(one) for one in weights]


def without_missing(channel: Numbers, weights: Array) -> Numbers:
    """Return a channel, the samples that have no weight missing."""
    return channel if (weights > 0).all() else np.where(weights > 0, channel, np.nan)


def spread(weights: Array | None) -> float:
    """Return the variance of a channel's noise over that of a sample of weight one; NaN where no sample counts."""
    if weights is None:
        return 1.0
    counted = weights[weights > 0]
    return float(np.mean(1 / counted)) if counted.size else np.nan


def _by_trial(given: Any, lengths: Sequence[int], *, several: bool) -> list[Array]:
    """Return checked weights, one array a trial."""
    is_list = isinstance(given, Sequence) and not isinstance(given, str) and len({np.size(one) for one in given}) > 1
    axes = 0 if is_list else arguments.any_array("weights", given).ndim
    if not is_list and not axes:
        raise ValueError(
            f"weights must be one for every sample; got the single value {arguments.shown(given)}; leave them out"
        )
    if axes == 1:
        shape = (lengths[0],)
        if len(set(lengths)) > 1:
            raise ValueError(
                f"weights of shape (n,) are those of all trials, which must have one length; got trials of {min(lengths)} to "
                f"{max(lengths)} samples; give a list with weights for each"
            )
        return [_checked("weights", given, shape)] * len(lengths)
    if not several:
        got = "a list of several lengths" if is_list else f"shape {np.shape(given)}"
        raise ValueError(
            f"weights must have shape ({lengths[0]},) beside one trial of several masses, since a sample has one weight; got {got}; "
            "take the least of those of its channels"
        )
    rows = list(given)
    if len(rows) != len(lengths):
        raise ValueError(
            f"weights must have a row for each of {len(lengths)} trials; got {len(rows)}; give one for every trial"
        )
    return [
        _checked(f"weights[{place}]", row, (length,))
        for place, (row, length) in enumerate(zip(rows, lengths, strict=True))
    ]


def _checked(name: str, given: Any, shape: tuple[int, ...]) -> Array:
    """Return weights of one trial; all of them may be zero, which leaves it out."""
    if np.shape(given) == shape and not np.any(np.ma.filled(given, 0)):
        return np.zeros(shape)
    found = arguments.weights(name, given, shape)
    assert found is not None  # noqa: S101 - they were given
    return found
