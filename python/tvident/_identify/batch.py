"""Results of records, put back into the shape of the batch and called by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._results import Estimates, scan_of
from tvident._status import Status

_Numbers: TypeAlias = npt.NDArray[np.float64]

_LOOKED_AT = 1 << 14
"""Samples of all records that are looked at."""


def estimates(
    shape: tuple[int, ...],
    names: Sequence[str],
    found: Sequence[_core.Identification],
    known: Mapping[str, npt.NDArray[np.number] | float],
) -> Estimates:
    """Return what was found in every record, by name, and beside it what was known beforehand.

    Parameters
    ----------
    shape : tuple of int
        Shape of the batch; empty for a single record.
    names : sequence of str
        Unknowns in the order of the core.
    found : sequence of Identification
        One a record.
    known : mapping of str to float or ndarray
        One value, or one for every sample there is a result at.
    """
    count = found[0].status.size

    def joined(arrays: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
        """Join one array a record, without a copy of a single one or of one number for all samples."""
        if len({one.size for one in arrays}) > 1:
            arrays = [np.broadcast_to(one, count) for one in arrays]
        together = np.stack(arrays) if len(arrays) > 1 else arrays[0]
        shaped = together.reshape(*shape, together.shape[-1])
        return shaped if shaped.shape[-1] == count else np.broadcast_to(shaped, (*shape, count))

    def alone(values: Sequence[float]) -> Any:
        """Return one number a record, in the shape of the batch."""
        return np.array(values).reshape(shape) if shape else float(values[0])

    values, errors, factors, constants = {}, {}, {}, {}
    status = joined([one.status for one in found])
    for place, name in enumerate(names):
        each = [one.unknowns[place] for one in found]
        values[name], errors[name] = joined([one.values for one in each]), joined([one.stderr for one in each])
    windowed = {
        name: np.array([one.unknowns[place].kind == "windowed" for one in found]).reshape(*shape, 1)
        for place, name in enumerate(names)
    }
    status = _leave_out_what_has_no_error(values, errors, status, windowed)
    for place, name in enumerate(names):
        each = [one.unknowns[place] for one in found]
        if any(one.factor != 1 for one in each):
            factors[name] = np.array([one.factor for one in each]).reshape(*shape, 1)
        if all(one.kind == "constant" for one in each):
            # Where only some records say that it changes there is no one number for all.
            constants[name] = (
                alone(values[name][..., 0].ravel().tolist()),
                alone(errors[name][..., 0].ravel().tolist()),
            )
    if any(one.angle_zero is not None for one in found):
        # Elsewhere the spring is relaxed where the encoder is at zero: that is assumed, as a known number is.
        zeros = [one.angle_zero for one in found]
        constants["angle_zero"] = (
            alone([0.0 if zero is None else zero.value for zero in zeros]),
            alone([0.0 if zero is None else zero.stderr for zero in zeros]),
        )
    for name, value in known.items():
        values[name] = np.broadcast_to(np.asarray(value, dtype=np.float64), (*shape, count))
        errors[name] = np.broadcast_to(np.float64(0), (*shape, count))
    pairs = combinations(range(sum(name in COEFFICIENTS for name in names)), 2)
    flags = np.array([one.record_status for one in found], dtype=np.uint16)
    has_orders = found[0].order.size == count
    return Estimates(
        values=values,
        errors=errors,
        factors=factors,
        covariances={
            frozenset((names[one], names[other])): joined([record.covariances[one, other] for record in found])
            for one, other in pairs
        },
        constants=constants,
        condition=joined([one.condition for one in found]),
        residual_std=joined([one.residual_std for one in found]),
        order=joined([one.order for one in found]) if has_orders else np.zeros((*shape, count), np.uint8),
        status=status,
        scans=tuple(scan_of(one.scan, names) for one in found if one.scan is not None),
        kinds={
            name: np.array([one.unknowns[place].kind for one in found]).reshape(shape)
            for place, name in enumerate(names)
        },
        record_status=flags.reshape(shape) if shape else Status(int(flags[0])),
        in_common={name: alone([one.unknowns[place].in_common for one in found]) for place, name in enumerate(names)},
    )


def with_inner(
    found: Estimates,
    inner: Mapping[str, _Numbers],
    unknown: Mapping[str, _Numbers],
    needed: Mapping[str, npt.NDArray[np.bool_]],
    count: int,
) -> Estimates:
    r"""Return numbers with inner parameters of terms, whose unknowns were by how much each is to be moved.

    Parameters
    ----------
    found : Estimates
    inner : mapping of str to ndarray, shape (records,)
        Values of inner parameters.
    unknown : mapping of str to ndarray, shape (records,)
        Standard errors of what is known of nothing but its range.
    needed : mapping of str to ndarray of bool, shape (records,)
        Whether the record tells more.
    count : int
        Numbers of a record.
    """
    values, errors = dict(found.values), dict(found.errors)
    factors, constants, scans = dict(found.factors), dict(found.constants), list(found.scans)
    records = np.shape(found.record_status)

    def alone(numbers: _Numbers) -> Any:
        return numbers.reshape(records) if records else float(numbers[0])

    for name, value in inner.items():
        error = unknown[name]
        if name in errors and errors[name].shape[-1]:
            told = (errors[name] * factors.pop(name, 1.0))[..., 0].ravel()
            error = np.where(np.isfinite(told) & needed[name], told, np.fmax(told, error))
        values[name] = np.broadcast_to(value.reshape(*records, 1), (*records, count))
        errors[name] = np.broadcast_to(error.reshape(*records, 1), (*records, count))
        constants[name] = (alone(value), alone(error))
        scans = [
            replace(scan, estimates={**scan.estimates, name: scan.estimates[name] + one})
            if name in scan.estimates
            else scan
            for scan, one in zip(scans, value.tolist(), strict=False)
        ]
    kinds = {**found.kinds, **{name: np.full(records, "constant") for name in inner}}
    return replace(
        found, values=values, errors=errors, factors=factors, constants=constants, scans=tuple(scans), kinds=kinds
    )


def of_windows(names: Sequence[str], found: Sequence[_core.Identification]) -> dict[str, Any]:
    """Return the lengths of the strong form's windows, and by how much those of a single record scatter more than least squares say.

    The latter is what a stream cannot know before its end.
    """
    lengths = {"window_length": found[0].window_length, "regression_window": found[0].regression_window}
    if len(found) != 1:
        return lengths
    each = zip(names, found[0].unknowns, strict=False)
    factors = {name: one.factor for name, one in each if one.kind == "windowed" and one.factor is not None}
    return {**lengths, "stderr_factors": factors} if factors else lengths


def _leave_out_what_has_no_error(
    values: dict[str, _Numbers],
    errors: dict[str, _Numbers],
    status: npt.NDArray[np.uint16],
    windowed: Mapping[str, npt.NDArray[np.bool_]],
) -> npt.NDArray[np.uint16]:
    """Leave out numbers whose standard error has no double, and return the status that says so.

    Powers of very large or very small samples leave the range of doubles, mostly in the whole record. So of many samples only some
    are looked at, which costs nothing.
    """
    before, some = status, slice(None, None, max(1, status.size // _LOOKED_AT))
    for name, value in values.items():
        error = errors[name]
        # One number for all samples is looked at once.
        is_one = value.strides[-1] == error.strides[-1] == 0 and np.isfinite((value[..., :1], error[..., :1])).all()
        if is_one or not _odd(value[..., some], error[..., some], status[..., some]).any():
            continue
        missing = ~(np.isfinite(value) & np.isfinite(error))
        values[name], errors[name] = np.where(missing, np.nan, value), np.where(missing, np.nan, error)
        status = np.where(missing, status | np.uint16(Status.INVALID), status)
    if status is not before:
        # What is windowed was solved together with what is missing now.
        for name, is_windowed in windowed.items():
            invalid = is_windowed & (status & Status.INVALID != 0)
            values[name], errors[name] = (np.where(invalid, np.nan, of[name]) for of in (values, errors))
    return status


def _odd(value: _Numbers, error: _Numbers, status: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    """Return where a number, its error and the status do not tell the same."""
    there = np.isfinite(value) & np.isfinite(error)
    missing = np.isnan(value) & np.isnan(error) & (status & Status.INVALID != 0)
    return np.asarray(~(there | missing))
