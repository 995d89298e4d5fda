"""Local polynomials of samples that have times of their own: every window is fitted at its samples' true times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives.automatic_times import choose_at_own_times
from tvident._derivatives.found import CHOSEN, Found, Scored, together
from tvident._derivatives.plans import SHORTEST_WINDOW
from tvident._derivatives.robust import with_clipped_residuals
from tvident._status import Status
from tvident._units import times_in_seconds

_FEWEST = 64
"""Samples of a record whose windows are chosen, at least."""


def period_or_times(
    values: Any, channel: npt.NDArray[np.number], **given: Any
) -> tuple[Any, float, npt.NDArray[np.float64] | None]:
    """Return times in seconds where samples have any, the sample period, and the times again where they are not uniform.

    The period is then their mean step. Where nothing is given, times are those that the container says its samples have.
    """
    if all(one is None for one in given.values()):
        given["t"] = arguments.implied_times(values)
    if given["t"] is not None:
        given["t"] = times_in_seconds(given["t"])
    is_alone = all(one is None for name, one in given.items() if name != "t")
    if is_alone and arguments.irregular_at_sight(given["t"], channel.shape[-1]) is not None:
        times: npt.NDArray[np.float64] = np.asarray(given["t"])
        return given["t"], _mean_step(times), times
    try:
        period = arguments.sample_period(channel.shape[-1], **given)
        arguments.check_no_lost_samples(given["t"], channel)
    except arguments.NotUniformError as error:
        return given["t"], _mean_step(error.times), error.times
    if given["t"] is None:
        arguments.check_against_labels(values, period)
    return given["t"], period, None


def _mean_step(times: npt.NDArray[np.float64]) -> float:
    """Return the mean step of times, the sample period where they are not uniform."""
    return float(times[-1] - times[0]) / (times.size - 1)


def check_plain(*others: object, selection: str) -> None:
    """Refuse what only windows of uniform times know."""
    if selection != "window":
        raise ValueError(
            f"selection must be 'window' where t is not uniform; got {arguments.shown(selection)}; leave it out, or resample the record"
        )
    if any(one is not None for one in others):
        raise ValueError(
            "weights, max_gap and min_observations need uniform times; those of t are not; leave them out, or leave the missing samples "
            "out of y and t"
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
    loss: str,
    omit: bool,
    quantisation: float,
    step: int,
    workers: int | None,
    progress: arguments.Progress,
) -> Found:
    """Return what was found in windows of so many samples, of a duration such as ``"0.2 s"``, or chosen as on a uniform grid."""
    automatic = isinstance(window_length, str) and window_length.strip() == "auto"
    if automatic and loss != "squares":
        raise ValueError(
            f"loss must be 'squares' where t is not uniform and windows are chosen; got {loss!r} with window_length='auto'; give a length, "
            "or resample the record"
        )
    length = None if automatic else _length(window_length, times)
    least = _FEWEST if length is None else length
    if order is not None and isinstance(least, int) and order >= least:
        raise ValueError(
            f"order must be less than window_length; got order {order} for a window of {least} samples; lower the order or lengthen the "
            "window"
        )
    settings: dict[str, Any] = {
        "window_length": window_length,
        "order": order,
        "max_order": max_order,
        "criterion": criterion,
        "selection": "window",
        "loss": loss,
        "quantisation": quantisation,
    }
    fit = _Fit(length, choose_on, max_deriv, workers, settings)
    with arguments.reporter(progress, "local polynomials") as report:
        if not omit or np.isfinite(samples).all():
            return fit.of(samples, times, step, report)
        each = [fit.of_those_there(record, times, least) for record in samples.reshape(-1, samples.shape[-1])]
        return together(each, samples.shape[:-1], step, CHOSEN if automatic else ())


@dataclass(frozen=True)
class _Fit:
    """Fits records.

    Parameters
    ----------
    length : int or float, optional
        Samples of a window, or seconds; chosen for every record where there is none.
    choose_on : callable
        Chooses on a uniform grid.
    max_deriv : int
    workers : int, optional
    settings : dict of str to object
        As results keep them.
    """

    length: int | float | None
    choose_on: Callable[..., Found]
    max_deriv: int
    workers: int | None
    settings: dict[str, Any]

    def of(
        self,
        records: npt.NDArray[np.number],
        times: npt.NDArray[np.float64],
        step: int,
        report: Callable[[int, int], object] | None,
    ) -> Found:
        """Return what is found in records at these times."""
        how = self.settings
        if self.length is None:
            return choose_at_own_times(
                records,
                times,
                self.choose_on,
                quantisation=how["quantisation"],
                step=step,
                workers=self.workers,
                progress=report,
            )
        plan = _core.WindowFit(
            times - times[0],
            self.length,
            order=how["order"],
            max_order=how["max_order"],
            criterion=how["criterion"],
            derivatives=self.max_deriv,
            quantisation=how["quantisation"],
        )
        if how["loss"] == "huber":
            length = self.length
            rows = length if isinstance(length, int) else max(1, round(length / float(np.median(np.diff(times)))))
            records = self._clipped(records, plan, rows)
        found = plan.estimate(records, step=step, workers=self.workers, progress=report).estimates

        def errors() -> npt.NDArray[np.float64]:
            fitted = plan.estimate(records, errors=True, step=step, workers=self.workers)
            assert fitted.stderr is not None  # noqa: S101 - asked for
            return fitted.stderr

        return Found(
            derivatives=found.derivatives,
            order=found.order,
            status=found.status,
            sigma=found.sigma,
            window_length=how["window_length"],
            settings=how,
            errors=errors,
            plan_of=lambda _: plan,
        )

    def of_those_there(self, record: npt.NDArray[np.number], times: npt.NDArray[np.float64], least: float) -> Found:
        """Return what is found in a record without its missing samples, if the others fill a window."""
        there = np.isfinite(record)
        if _is_enough(times[there], least):
            return _scattered(self.of(record[there], times[there], 1, None), there)
        return self.of(np.full(times.size, np.nan), times, 1, None)

    def _clipped(self, records: npt.NDArray[np.number], plan: _core.WindowFit, rows: int) -> npt.NDArray[np.number]:
        """Return records whose residuals are clipped, in windows of about so many rows."""

        def value(some: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
            return np.asarray(plan.estimate(some, step=1, workers=self.workers).estimates.derivatives[0])

        return with_clipped_residuals(records, value, rows, omit=False)


def _is_enough(times: npt.NDArray[np.float64], length: float) -> bool:
    """Return whether samples at these times fill a window of so many, or so long."""
    if isinstance(length, int):
        return times.size >= length
    return times.size >= SHORTEST_WINDOW and bool(times[-1] - times[0] >= length)


@dataclass(frozen=True)
class _OfThose:
    """Windows of the samples that are there, known by the numbers of all."""

    plan: Scored
    there: npt.NDArray[np.bool_]

    def scores(self, samples: npt.NDArray[np.number], sample: int, /) -> npt.NDArray[np.float64]:
        """Return the criterion of every order in the window around a sample; NaN where it is missing."""
        place = int(np.count_nonzero(self.there[:sample]))
        found = self.plan.scores(np.ascontiguousarray(samples[self.there]), min(place, int(self.there.sum()) - 1))
        return found if self.there[sample] else np.full_like(found, np.nan)


def _scattered(found: Found, there: npt.NDArray[np.bool_]) -> Found:
    """Return what was found of the samples of a record that are there, at the places of all."""

    def placed(values: npt.NDArray[Any], nothing: Any) -> npt.NDArray[Any]:
        every = np.full((*values.shape[:-1], there.size), nothing, values.dtype)
        every[..., there] = values
        return every

    return replace(
        found,
        derivatives=placed(found.derivatives, np.nan),
        order=placed(found.order, 0),
        status=placed(found.status, Status.INVALID | Status.GAP),
        sigma=placed(found.sigma, np.nan),
        errors=lambda: placed(found.errors(), np.nan),
        plan_of=lambda index: _OfThose(found.plan_of(index), there),
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
