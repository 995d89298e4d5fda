"""Parts of a result: some of its samples, some of its records."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import EllipsisType
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._results.estimates import Estimates
from tvident._status import Status

At: TypeAlias = float | str | dt.date | np.datetime64 | None
"""When a part of a result begins or ends: seconds, or a date."""

RecordIndex: TypeAlias = (
    int | slice | EllipsisType | Sequence[int] | npt.NDArray[np.bool_] | npt.NDArray[np.integer] | None
)
"""What stands for records of a batch, as in NumPy's indexing."""

_LISTS = ("lag_samples", "lag_untold", "shown_noise")
_ONE_EACH = (
    "window_length",
    "exponent",
    "regression_window",
    "lag",
    "lag_stderr",
    "angle_zero",
    "width_from",
    "windows_near",
)
_BY_RECORD = (*_ONE_EACH, *_LISTS)
"""Settings that are a list where there are several records."""


def samples_between(
    time: npt.NDArray[np.float64], begin: At, end: At, labels: arguments.Labels | None = None
) -> tuple[slice, float, float]:
    """Return the samples from one time to another, both included, and these times; infinite where none was given.

    Raises
    ------
    ValueError
        If nothing lies in between.
    """
    first, last = (
        fallback if at is None else arguments.finite_number(name, _in_seconds(name, at, time, labels))
        for name, at, fallback in (("begin", begin, -np.inf), ("end", end, np.inf))
    )
    samples = slice(int(np.searchsorted(time, first)), int(np.searchsorted(time, last, side="right")))
    if samples.start >= samples.stop:
        ends = f"{time[0]:g} to {time[-1]:g} s" if time.size else "no samples"
        raise ValueError(f"a part must hold samples; got {begin} to {end} s; the result has {ends}")
    return samples, first, last


def _in_seconds(name: str, at: Any, time: npt.NDArray[np.float64], labels: arguments.Labels | None) -> Any:
    """Return a date in the seconds of a result whose samples have dates, anything else as it is."""
    if not isinstance(at, str | dt.date | np.datetime64) or labels is None or not time.size:
        return at
    index = (
        labels.index if labels.index is not None else labels.coordinates.get(labels.dims[-1] if labels.dims else None)
    )
    if index is None or index.dtype.kind != "M":
        return at
    try:
        if labels.index is None:
            return float(time[0]) + float((np.datetime64(at) - np.asarray(index)[0]) / np.timedelta64(1, "s"))
        stamp = type(index[0])(at)
        stamp = stamp.tz_localize(index.tz) if index.tz is not None and stamp.tz is None else stamp
        return float(time[0]) + float((stamp - index[0]).total_seconds())
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} must be a date as the samples have, or seconds; got {arguments.shown(at)}; the first sample is that of {index[0]}"
        ) from None


def of_samples(found: Estimates, samples: slice) -> Estimates:
    """Return the estimates of some samples."""
    return replace(
        found,
        values={name: values[..., samples] for name, values in found.values.items()},
        errors={name: errors[..., samples] for name, errors in found.errors.items()},
        covariances={pair: values[..., samples] for pair, values in found.covariances.items()},
        condition=found.condition[..., samples],
        residual_std=found.residual_std[..., samples],
        order=found.order[..., samples],
        status=found.status[..., samples],
        labels=None if found.labels is None else found.labels.at(samples),
        is_part=found.is_part or samples.stop - samples.start < found.status.shape[-1],
    )


def of_records(found: Estimates, place: Any) -> Estimates:
    """Return the estimates of one record or of some, as NumPy's indexing of the batch has them."""
    kinds = {name: np.asarray(kind)[place] for name, kind in found.kinds.items()}
    values, errors = ({name: each[place] for name, each in of.items()} for of in (found.values, found.errors))

    def number(each: Any) -> Any:
        return float(each) if np.ndim(each) == 0 else np.asarray(each)

    constants = {
        name: (
            (number(found.constants[name][0][place]), number(found.constants[name][1][place]))
            if name in found.constants
            else (number(values[name][..., 0]), number(errors[name][..., 0]))
        )
        for name, kind in kinds.items()
        if np.all(kind == "constant") and values[name].shape[-1]
    }
    if "angle_zero" in found.constants:
        zero, error = (number(each[place]) for each in found.constants["angle_zero"])
        if np.any(error):
            constants["angle_zero"] = (zero, error)
    batch = found.status.shape[:-1]
    flags = np.asarray(found.record_status)[place]
    return replace(
        found,
        values=values,
        errors=errors,
        factors={name: factor[place] for name, factor in found.factors.items()},
        covariances={pair: each[place] for pair, each in found.covariances.items()},
        constants=constants,
        in_common={name: number(np.asarray(part)[place]) for name, part in found.in_common.items()},
        condition=found.condition[place],
        residual_std=found.residual_std[place],
        order=found.order[place],
        status=found.status[place],
        record_status=flags if np.ndim(flags) else Status(int(flags)),
        scans=tuple(found.scans[one] for one in chosen(place, batch)) if found.scans else (),
        labels=None if found.labels is None else found.labels.of_records(place, np.ndim(flags)),
        kinds=kinds,
    )


def in_batch(place: Any, batch: tuple[int, ...]) -> Any:
    """Return an index of records without an ellipsis, which would reach the axis of samples where arrays have one.

    Raises
    ------
    IndexError
        If there are no such records.
    """
    parts = place if isinstance(place, tuple) else (place,)
    try:
        np.empty(batch, bool)[place]
    except IndexError as error:
        raise IndexError(
            f"an index must name records of a batch of shape {batch}; got {arguments.shown(place)}: {error}; samples are those of "
            "result.between(t0, t1)"
        ) from None
    at = next((number for number, part in enumerate(parts) if part is Ellipsis), None)
    if at is None:
        return place
    left = len(batch) - sum(_axes_taken(part) for part in parts if part is not Ellipsis)
    return (*parts[:at], *[slice(None)] * left, *parts[at + 1 :])


def _axes_taken(part: Any) -> int:
    """Return how many axes a part of an index stands for."""
    if part is None:
        return 0
    values = np.asarray(part) if not isinstance(part, slice) else np.asarray(0)
    return values.ndim if values.dtype == bool else 1


def chosen(place: Any, batch: tuple[int, ...]) -> list[int]:
    """Return the numbers of some records, counted along the flattened axes of the batch."""
    picked = np.arange(int(np.prod(batch, dtype=int))).reshape(batch)[place]
    return [int(record) for record in np.ravel(picked)]


def settings_of(
    settings: Mapping[str, Any], records: Sequence[int], kinds: Mapping[str, npt.NDArray[np.str_]], *, alone: bool
) -> dict[str, Any]:
    """Return the settings of some of the records."""
    own = dict(settings)
    for name in _BY_RECORD:
        if isinstance(own.get(name), list):
            picked = [own[name][record] for record in records]
            own[name] = picked[0] if alone and name not in _LISTS else picked
    for name in ("inner", "needed"):
        parts = {key: [one[record] for record in records] for key, one in own[name].items()}
        own[name] = {key: one[0] if alone else one for key, one in parts.items()}
    own["kinds"] = dict(own["kinds"])
    for name, kind in ((name, kind) for name, kind in kinds.items() if name in own["kinds"]):
        different = np.unique(kind)
        if different.size == 1:
            own["kinds"][name] = str(different[0])
    own["terms"] = [[name, own["kinds"][name]] for name, _ in own["terms"]]
    return own
