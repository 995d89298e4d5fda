"""Huber's loss of the torque: its residuals are clipped and the record is identified again until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal, TypeAlias, cast, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._huber import Clipped, clip_residuals, has_heavy_tails
from tvident._identify.data import Data
from tvident._results import Identification, predicted_at_samples

LossAsked: TypeAlias = Literal["squares", "huber", "auto"]

_ROUNDS = 10
_SETTLED = 0.02
"""Rounds end where what was clipped moves by no more than this part of the scale: far below any standard error. They end too where it comes
back to what it was two rounds before: two choices of windows take turns there, and would until the last round."""


def loss_of(given: LossAsked | None, settings: Mapping[str, Any] | None) -> LossAsked:
    """Return the loss that was given, that of an earlier result, or that of least squares."""
    word = arguments.one_of(
        "loss", (settings or {}).get("loss") or "squares" if given is None else given, get_args(LossAsked)
    )
    return cast("LossAsked", word)


def with_clipped_torque(data: Data, loss: LossAsked, identified: Callable[[Data], Identification]) -> Data:
    """Return the records with a torque whose least squares are those of Huber's loss.

    Parameters
    ----------
    data : Data
    loss : {"squares", "huber", "auto"}
        ``"auto"``: only of records in which many more residuals are far from zero than of normal noise. Of samples with weights they are
        compared times the roots of these, or of those around them, which makes their noise the same.
    identified : callable
        Identifies records.
    """
    if loss == "squares":
        return data
    samples = data.time.size
    recorded = data.torques.reshape(-1, samples).astype(np.float64)
    torques, shares = recorded.copy(), np.zeros(data.records)
    before = recorded.copy()
    open_records = list(range(data.records))
    for turn in range(_ROUNDS):
        found = identified(replace(data, torques=torques.reshape(data.torques.shape)))
        for record in list(open_records):
            place = tuple(int(index) for index in np.unravel_index(record, data.batch))
            one = found[place] if place else found
            root = _root(data, place, one)
            given, predicted = recorded[record] * root, predicted_at_samples(one) * root
            if turn == 0 and loss == "auto" and not has_heavy_tails(given, predicted):
                open_records.remove(record)
                continue
            clipped = clip_residuals(given, predicted)
            # Where the prediction is far noisier than the sample, that stays as it is.
            kept = np.where(np.isnan(root), recorded[record], clipped.values / root)
            is_settled = not _differs(clipped, torques[record] * root)
            if not is_settled and turn > 1 and not _differs(clipped, before[record] * root):
                is_settled = True
                if (_ROUNDS - 1 - turn) % 2 == 1:
                    # The last round would be one of the others.
                    kept, clipped = torques[record], replace(clipped, share=shares[record])
            before[record], torques[record] = torques[record], kept
            shares[record] = clipped.share
            if is_settled:
                open_records.remove(record)
        if not open_records:
            break
    return replace(data, torques=torques.reshape(data.torques.shape), clipped=tuple(shares.tolist()))


def _differs(clipped: Clipped, values: npt.NDArray[np.float64]) -> bool:
    """Return whether what was clipped is more than rounding away from some values."""
    with np.errstate(invalid="ignore"):  # infinite samples stay as they are
        moved = np.abs(clipped.values - values)
    return bool(np.nanmax(moved, initial=0.0) > _SETTLED * clipped.scale)


def _root(data: Data, place: tuple[int, ...], found: Identification) -> npt.NDArray[np.float64]:
    """Return what residuals of the torque of one record are multiplied by to have the same noise."""
    length = found.settings["window_length"]
    if data.weights is None or not isinstance(length, int):
        return np.ones(1)
    # The prediction is made in windows half as long.
    return data.weights.part(place).roots(length // 2)
