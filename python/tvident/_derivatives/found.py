"""Estimates of the core, before they are put into the shape of the samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

CHOSEN = ("window_length", "order", "noise", "quantisation")
"""Settings that every record has for itself where windows are chosen."""


class Scored(Protocol):
    """Windows of one record."""

    def scores(self, samples: npt.NDArray[np.number], sample: int, /) -> npt.NDArray[np.float64]:
        """Return the criterion of every order in the window around a sample."""


@dataclass(frozen=True)
class Found:
    """What is known of some records, with the axis of time last."""

    derivatives: npt.NDArray[np.float64]
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]
    sigma: npt.NDArray[np.float64]
    window_length: int | str | npt.NDArray[np.intp]
    settings: dict[str, Any]
    errors: Callable[[], npt.NDArray[np.float64]]
    """Gives the standard errors, in the shape of the derivatives."""
    plan_of: Callable[[tuple[int, ...]], Scored]
    """Gives the plan of a record's windows."""


def together(each: Sequence[Found], leading: tuple[int, ...], step: int, by_record: Sequence[str] = ()) -> Found:
    """Return what was found of records one after the other, for the wanted samples; some settings are those of every record."""

    def stacked(arrays: Sequence[npt.NDArray[Any]], axis: int) -> npt.NDArray[Any]:
        together = np.stack([array[..., ::step] for array in arrays], axis=axis)
        shape = (*together.shape[:axis], *leading, together.shape[-1])
        return together.reshape(shape)

    def listed(name: str) -> object:
        values = np.array([one.settings[name] for one in each]).T
        return values.reshape((*values.shape[:-1], *leading)).tolist()

    own = {name: listed(name) for name in by_record}
    return replace(
        each[0],
        derivatives=stacked([one.derivatives for one in each], 1),
        order=stacked([one.order for one in each], 0),
        status=stacked([one.status for one in each], 0),
        sigma=stacked([one.sigma for one in each], 0),
        window_length=np.array(own["window_length"], np.intp) if "window_length" in own else each[0].window_length,
        settings={**each[0].settings, **own},
        errors=lambda: stacked([one.errors() for one in each], 1),
        plan_of=lambda index: each[int(np.ravel_multi_index(index, leading)) if leading else 0].plan_of(()),
    )
