"""Results of records, put back into the shape of the batch and called by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._results import Estimates
from tvident._status import Status

_LOOKED_AT = 4096
"""Samples at which a long record is looked at."""


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
    believed = [_believed(one) for one in found]
    for place, name in enumerate(names):
        each = [one.unknowns[place] for one in found]
        values[name], errors[name] = (joined([numbers[which][place] for numbers in believed]) for which in (0, 1))
        if any(one.factor != 1 for one in each):
            factors[name] = np.array([one.factor for one in each]).reshape(*shape, 1)
        if all(one.kind == "constant" for one in each):
            # Where only some records say that it changes there is no one number for all.
            constants[name] = (
                alone(values[name][..., 0].ravel().tolist()),
                alone(errors[name][..., 0].ravel().tolist()),
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
        status=joined([status for _, _, status in believed]),
        record_status=flags.reshape(shape) if shape else Status(int(flags[0])),
    )


def _believed(
    one: _core.Identification,
) -> tuple[list[npt.NDArray[np.float64]], list[npt.NDArray[np.float64]], npt.NDArray[np.uint16]]:
    """Return the values of one record, their errors and the status: a number whose error has no double is no number.

    Powers of very large or very small samples leave the range of doubles, mostly in the whole record. So of long records only some
    samples are looked at, which costs nothing.
    """
    values, errors = [unknown.values for unknown in one.unknowns], [unknown.stderr for unknown in one.unknowns]
    status = one.status
    for place in range(len(values)):
        value, error = values[place], errors[place]
        some = slice(None, None, max(1, value.size // _LOOKED_AT))
        if not _odd(value[some], error[some], status[some] if value.size > 1 else status).any():
            continue
        missing = ~(np.isfinite(value) & np.isfinite(error))
        values[place], errors[place] = np.where(missing, np.nan, value), np.where(missing, np.nan, error)
        status = np.where(missing, status | np.uint16(Status.INVALID), status)
    if status is not one.status:
        # What is windowed was solved together with what is missing now.
        invalid = status & Status.INVALID != 0
        windowed = [place for place, unknown in enumerate(one.unknowns) if unknown.kind == "windowed"]
        for place in windowed:
            values[place], errors[place] = (np.where(invalid, np.nan, of[place]) for of in (values, errors))
    return values, errors, status


def _odd(
    value: npt.NDArray[np.float64], error: npt.NDArray[np.float64], status: npt.NDArray[np.uint16]
) -> npt.NDArray[np.bool_]:
    """Return where a number, its error and the status do not tell the same."""
    there = np.isfinite(value) & np.isfinite(error)
    missing = np.isnan(value) & np.isnan(error) & (status & Status.INVALID != 0)
    return np.asarray(~(there | missing))
