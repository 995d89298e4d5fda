"""Local polynomials of samples that have times of their own: every window is fitted at its samples' true times."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives.automatic_times import choose_at_own_times
from tvident._derivatives.found import Found
from tvident._derivatives.plans import SHORTEST_WINDOW


def period_or_times(samples: int, **given: Any) -> tuple[float, npt.NDArray[np.float64] | None]:
    """Return the sample period, and the times where they are not uniform; the period is then their mean step."""
    try:
        return arguments.sample_period(samples, **given), None
    except arguments.NotUniformError as error:
        return float(error.times[-1] - error.times[0]) / (samples - 1), error.times


def check_plain(nan_policy: str, *others: object, selection: str, loss: str) -> None:
    """Refuse what only windows of uniform times know."""
    for name, value, known in (("selection", selection, "window"), ("loss", loss, "squares")):
        if value != known:
            raise ValueError(
                f"{name} must be {known!r} where t is not uniform; got {arguments.shown(value)}; leave it out, or resample the record"
            )
    if nan_policy == "omit" or any(one is not None for one in others):
        raise ValueError(
            "nan_policy='omit', weights, max_gap and min_observations need uniform times; those of t are not; leave them out, or leave the "
            "missing samples out of y and t"
        )


# All that a fit depends on.
def at_own_times(
    samples: npt.NDArray[np.number],
    times: npt.NDArray[np.float64],
    window_length: int | str,
    *,
    choose_on: Callable[..., Found],
    order: int | None,
    max_order: int,
    criterion: str,
    max_deriv: int,
    quantisation: float,
    step: int,
    workers: int | None,
    progress: arguments.Progress,
) -> Found:
    """Return what was found in windows of so many samples, of a duration such as ``"0.2 s"``, or chosen as on a uniform grid."""
    if isinstance(window_length, str) and window_length.strip() == "auto":
        return choose_at_own_times(
            samples, times, choose_on, quantisation=quantisation, step=step, workers=workers, progress=progress
        )
    length = _length(window_length, times)
    if order is not None and isinstance(length, int) and order >= length:
        raise ValueError(
            f"order must be less than window_length; got order {order} for a window of {length} samples; lower the order or lengthen the "
            "window"
        )
    plan = _core.WindowFit(
        times - times[0],
        length,
        order=order,
        max_order=max_order,
        criterion=criterion,
        derivatives=max_deriv,
        quantisation=quantisation,
    )
    with arguments.reporter(progress, "local polynomials") as report:
        estimates, errors = plan.estimate(samples, step=step, workers=workers, progress=report)
    settings: dict[str, Any] = {
        "window_length": window_length,
        "order": order,
        "max_order": max_order,
        "criterion": criterion,
        "selection": "window",
        "loss": "squares",
        "quantisation": quantisation,
    }
    return Found(
        derivatives=estimates.derivatives,
        order=estimates.order,
        status=estimates.status,
        sigma=estimates.sigma,
        window_length=window_length,
        settings=settings,
        errors=lambda: errors,
        plan_of=lambda _: plan,
    )


def _length(window_length: int | str, times: npt.NDArray[np.float64]) -> int | float:
    """Return samples, or seconds."""
    if not isinstance(window_length, str):
        length = arguments.window_length("window_length", window_length, 1.0, odd=True)
        arguments.check_window("window_length", length, times.size, least=SHORTEST_WINDOW)
        return length
    seconds, record = arguments.seconds("window_length", window_length), float(times[-1] - times[0])
    if seconds > record:
        raise ValueError(
            f"window_length must be less than or equal to the length of the record; got {window_length} for a record of {record:.6g} s; "
            "shorten it"
        )
    return seconds
