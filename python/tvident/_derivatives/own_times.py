"""Local polynomials of samples that have times of their own: every window is fitted at its samples' true times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives import incomplete
from tvident._derivatives.automatic_times import choose_at_own_times
from tvident._derivatives.found import CHOSEN, Found, Scored, together
from tvident._derivatives.plans import SHORTEST_WINDOW
from tvident._derivatives.robust import with_clipped_residuals
from tvident._status import Status
from tvident._units import times_in_seconds

Array = npt.NDArray[np.float64]

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


@dataclass(frozen=True)
class LeftOut:
    r"""What is left out of windows, and what they must hold.

    Parameters
    ----------
    omit : bool
        Samples that are no numbers are left out.
    weights : ndarray, shape (\*, n), optional
    max_gap : int or str, optional
        Windows reach across all gaps where there is none.
    min_observations : int, optional
    """

    omit: bool
    weights: Array | None
    max_gap: int | str | None
    min_observations: int | None

    @property
    def is_plain(self) -> bool:
        """Whether nothing is asked for but windows of the samples that are there."""
        return self.weights is None and self.max_gap is None and self.min_observations is None

    def there(self, record: npt.NDArray[np.number], weight: Array | None) -> npt.NDArray[np.bool_]:
        """Return which samples of a record are not left out."""
        held = np.isfinite(record) if self.omit else np.ones(record.size, np.bool_)
        return held if weight is None else held & (weight > 0)

    def parts(self, there: npt.NDArray[np.bool_], times: Array) -> list[npt.NDArray[np.intp]]:
        """Return the numbers of the samples that are there, between gaps that are too long."""
        places = np.flatnonzero(there)
        if self.max_gap is None:
            return [places]
        usual = float(np.median(np.diff(times)))
        # As samples that are missing are counted where times are uniform; half a step is left to their scatter.
        longest = (incomplete.longest_gap(self.max_gap, usual) or 0) + 1.5
        return np.split(places, np.flatnonzero(np.diff(times[places]) > longest * usual) + 1)


# Arguments of the call, and what they are checked by.
def left_out_of_own_times(
    nan_policy: str,
    weights: Array | None,
    max_gap: int | str | None,
    min_observations: int | None,
    *,
    window_length: int | str,
    selection: str,
) -> LeftOut | None:
    """Return what is left out, as it was asked for, None where windows are to be whole; refuse what does not go with it."""
    if selection != "window":
        raise ValueError(
            f"selection must be 'window' where t is not uniform; got {arguments.shown(selection)}; leave it out, or resample the record"
        )
    if not incomplete.leaves_out(nan_policy, max_gap, min_observations, weighted=weights is not None):
        return None
    automatic = is_automatic(window_length)
    if automatic and max_gap is not None:
        raise ValueError(
            f"max_gap must be left out where t is not uniform and windows are chosen, of which each ends at steps longer than half of it; "
            f"got {arguments.shown(max_gap)} with window_length='auto'; leave it out, or give a length"
        )
    if weights is not None or min_observations is not None:
        incomplete.check_weighted(automatic=automatic, weighted=weights is not None, selection=selection)
    if min_observations is not None:
        most = None if isinstance(window_length, str) else window_length
        min_observations = incomplete.least_given(min_observations, most)
    if max_gap is not None:
        arguments.length_given("max_gap", max_gap)
    return LeftOut(nan_policy == "omit", weights, max_gap, min_observations)


def is_automatic(window_length: int | str) -> bool:
    """Return whether windows are chosen."""
    return isinstance(window_length, str) and window_length.strip() == "auto"


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
    left: LeftOut | None,
    quantisation: float,
    step: int,
    workers: int | None,
    progress: arguments.Progress,
) -> Found:
    """Return what was found in windows of so many samples, of a duration such as ``"0.2 s"``, or chosen as on a uniform grid."""
    automatic = is_automatic(window_length)
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
        if left is None or (left.is_plain and np.isfinite(samples).all()):
            return fit.of(samples, times, step, report)
        each = []
        for index in np.ndindex(samples.shape[:-1]):
            weight = None if left.weights is None else left.weights[index]
            each.append(fit.of_those_there(samples[index], weight, times, least, left))
            if report is not None:
                report(times.size * len(each), samples.size)
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
        weights: Array | None = None,
        least: int = SHORTEST_WINDOW,
    ) -> Found:
        """Return what is found in records at these times, whose samples may have weights."""
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
            weights=weights,
            least=least,
        )
        if how["loss"] == "huber":
            length = self.length
            rows = length if isinstance(length, int) else max(1, round(length / float(np.median(np.diff(times)))))
            records = self._clipped(records, plan, rows, weights)
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

    def of_those_there(
        self, record: npt.NDArray[np.number], weight: Array | None, times: Array, length: float, left: LeftOut
    ) -> Found:
        """Return what is found in the parts of a record without what is left out, of those that hold enough."""
        there = left.there(record, weight)
        fitted = []
        for places in left.parts(there, times):
            full = _is_enough(times[places], length)
            if not full and (left.is_plain or not self._fills(places.size, left)):
                continue
            found = self._weighted(record[places], None if weight is None else weight[places], times[places], left)
            # Windows of a part that is shorter lack samples.
            fitted.append((places, found if full else replace(found, status=found.status | np.uint16(Status.GAP))))
        if not fitted:
            nothing = self.of(np.full(times.size, np.nan), times, 1, None)
            return nothing if left.is_plain else replace(nothing, status=nothing.status | np.uint16(Status.GAP))
        return _scattered(fitted, times.size)

    def _fills(self, samples: int, left: LeftOut) -> bool:
        """Return whether a part that is shorter than a window holds enough samples, and as many as its order needs."""
        return samples >= max(self._least(left), (self.settings["order"] or 0) + 1)

    def _least(self, left: LeftOut) -> int:
        """Return how many samples a window must hold."""
        if left.min_observations is not None:
            return left.min_observations
        return (self.length + 1) // 2 if isinstance(self.length, int) and not left.is_plain else SHORTEST_WINDOW

    def _weighted(self, record: npt.NDArray[np.number], weight: Array | None, times: Array, left: LeftOut) -> Found:
        """Return what is found in a record of which nothing is left out; where all weights are alike, that without any."""
        least = self._least(left)
        if weight is None or weight.min() < weight.max():
            return self.of(record, times, 1, None, None if weight is None else np.ascontiguousarray(weight), least)
        found = self.of(record, times, 1, None, None, least)
        return replace(found, sigma=found.sigma * np.sqrt(weight[0]))

    def _clipped(
        self, records: npt.NDArray[np.number], plan: _core.WindowFit, rows: int, weights: Array | None
    ) -> npt.NDArray[np.number]:
        """Return records whose residuals are clipped, in windows of about so many rows; the plan knows the weights."""

        def value(some: Array, _: Array | None) -> Array:
            found = plan.estimate(np.ascontiguousarray(some), step=1, workers=self.workers)
            return np.asarray(found.estimates.derivatives[0])

        return with_clipped_residuals(records, value, rows, omit=False, weights=weights)


def _is_enough(times: npt.NDArray[np.float64], length: float) -> bool:
    """Return whether samples at these times fill a window of so many, or so long."""
    if isinstance(length, int):
        return times.size >= length
    return times.size >= SHORTEST_WINDOW and bool(times[-1] - times[0] >= length)


@dataclass(frozen=True)
class _OfThose:
    """Windows of the samples that are there, in parts of the record, known by the numbers of all."""

    parts: list[tuple[npt.NDArray[np.intp], Scored]]

    def scores(self, samples: npt.NDArray[np.number], sample: int, /) -> npt.NDArray[np.float64]:
        """Return the criterion of every order in the window around a sample; NaN where it is missing."""
        places, plan = next((one for one in self.parts if sample <= one[0][-1]), self.parts[-1])
        place = min(int(np.searchsorted(places, sample)), places.size - 1)
        found = plan.scores(np.ascontiguousarray(samples[places]), place)
        return found if places[place] == sample else np.full_like(found, np.nan)


def _scattered(parts: list[tuple[npt.NDArray[np.intp], Found]], count: int) -> Found:
    """Return what was found in parts of a record, of the samples that are there, at the places of all."""

    def placed(of: Callable[[Found], npt.NDArray[Any]], nothing: Any) -> npt.NDArray[Any]:
        each = [of(found) for _, found in parts]
        every = np.full((*each[0].shape[:-1], count), nothing, each[0].dtype)
        for (places, _), values in zip(parts, each, strict=True):
            every[..., places] = values
        return every

    return replace(
        parts[0][1],
        derivatives=placed(lambda found: found.derivatives, np.nan),
        order=placed(lambda found: found.order, 0),
        status=placed(lambda found: found.status, Status.INVALID | Status.GAP),
        sigma=placed(lambda found: found.sigma, np.nan),
        errors=lambda: placed(lambda found: found.errors(), np.nan),
        plan_of=lambda index: _OfThose([(places, found.plan_of(index)) for places, found in parts]),
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
