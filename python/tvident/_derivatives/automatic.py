"""Window lengths chosen from each record, and the estimates with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._derivatives.found import Found


# What users give to fit_local_polynomials comes here as it is.
def choose(
    samples: npt.NDArray[Any],
    plan_of_window: Callable[[int], _core.LocalPolynomials],
    *,
    max_deriv: int,
    max_order: int,
    order: int | None,
    delta: float,
    quantisation: float | None,
    step: int,
    workers: int | None,
    progress: Callable[[int, int], object] | None,
) -> Found:
    """Choose window and order for every record along the last axis and every derivative, and estimate."""
    count = samples.shape[-1]
    if count < _core.FEWEST_SAMPLES:
        raise ValueError(
            f"a record must hold at least {_core.FEWEST_SAMPLES} samples where window_length='auto'; got {count}; "
            "give a window of some length or a longer record"
        )
    highest = max_order if order is None else order
    if highest < max_deriv:
        name = "max_order" if order is None else "order"
        raise ValueError(
            f"{name} must be at least max_deriv where window_length='auto'; got {highest} for derivative {max_deriv}; "
            f"use {name}={max_deriv} or more, or ask for fewer derivatives"
        )
    found = _core.estimate_automatically(
        samples,
        list(range(max_deriv + 1)),
        highest,
        order is not None,
        delta,
        quantisation,
        workers=workers,
        progress=progress,
    )
    leading = samples.shape[:-1]
    pairs = np.array(found.chosen, dtype=np.intp).reshape(max_deriv + 1, *leading, 2)
    noise = np.array(found.noise).reshape(*leading, 2)
    lengths = pairs[..., 0]

    def plan_of(index: tuple[int, ...]) -> _core.LocalPolynomials:
        # A record of nothing but missing values has no window; any will do to say so.
        return plan_of_window(int(lengths[(-1, *index)]) or _core.FEWEST_SAMPLES - 1)

    shape = (*leading, len(range(0, count, step)))
    return Found(
        derivatives=found.derivatives[..., ::step],
        order=found.order[..., ::step],
        status=found.status[..., ::step],
        sigma=np.broadcast_to(noise[..., :1], shape).copy(),
        window_length=lengths,
        settings={
            "window_length": lengths.tolist(),
            "order": pairs[..., 1].tolist(),
            "max_order": highest,
            "noise": noise[..., 0].tolist(),
            "quantisation": noise[..., 1].tolist(),
        },
        errors=lambda: found.stderr[..., ::step],
        plan_of=plan_of,
    )
