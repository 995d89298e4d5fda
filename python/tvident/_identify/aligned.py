"""The clock of the torque beside that of the angle: by how much it is late, and how that grows, from the equation itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._identify.data import Data

Numbers: TypeAlias = npt.NDArray[np.float64]
Align: TypeAlias = float | str | None

Late: TypeAlias = tuple[float, float]
"""Seconds at the start of the record, and seconds more each second."""

_FARTHEST = 0.1
"""Part of the record by which the torque may be late, at most."""

_MOST_LEFT = 0.7
"""The best alignment leaves at most this part of what alignments leave on the middle."""

_PARTS, _SHORTEST = 6, 1500
"""Parts of a record whose lags tell a drift, and samples of the shortest."""

_SURE = 5.0
"""Standard errors that a drift which nobody asked for must be away from none."""

_SHORTEST_SEARCH = 64
"""Samples without which nothing is looked for: no equation holds for so few."""

_VARIES, _ROWS = 12, 100
"""Cosines over the record by which the stiffness may vary at any alignment, at most, and equations for each, at least."""

_AS_GOOD = 1.5
"""The alignment that is best for constants is taken where one that is better with such a stiffness leaves hardly less."""

_ROUNDS = 3
"""Rounds of aligning with what was found."""


@dataclass(frozen=True)
class Aligned:
    """How late the torque's stamps are.

    Parameters
    ----------
    late : (float, float)
    errors : (float, float)
        Standard errors; NaN where the record does not tell.
    doubt : str
        What is wrong; empty where nothing is.
    moves : tuple of (float, float)
        By how much the alignment moves with each of its errors that are independent of each other, one standard error of each.
    """

    late: Late
    errors: Late
    doubt: str = ""
    moves: tuple[Late, ...] = ()


def aligned(data_of: Callable[[Late], Data], lag_of: Callable[[Data], tuple[float, float]], align: str) -> Aligned:
    """Return by how much the torque is late.

    Parameters
    ----------
    data_of : callable
        Gives the record with a torque that is late by so much.
    lag_of : callable
        Gives the lag that is left in a record, in seconds, and its standard error.
    align : {"offset", "drift"}
    """
    data = data_of((0.0, 0.0))
    period, start = data.period, float(data.time[0])
    shift, share = _coarse(data.angles, data.torques)
    late: Late = (shift * period, 0.0)
    errors: Late = (math.nan, math.nan)
    moves: tuple[Late, ...] = ()
    doubt = ""
    if not share <= _MOST_LEFT:
        doubt = "the record hardly tells how the clocks of angle and torque are aligned: excite several frequencies, or give both times"
    for _ in range(_ROUNDS):
        data = data_of(late)
        lags, middles = ([lag_of(data)], [0.0]) if align == "offset" else _lags_of_parts(data, lag_of, start)
        left, errors, moves = _line(middles, lags, align)
        if not all(math.isfinite(one) for one in (*left, errors[0])):
            drifts = _drifts(data, lag_of, start) if align == "offset" else ""
            return Aligned(late, (math.nan, math.nan), doubt or drifts or "no lag could be told from the damping")
        late = (late[0] + left[0], late[1] + left[1])
        if abs(left[0]) <= errors[0] / 2 and abs(left[1]) <= (errors[1] / 2 if align == "drift" else 0.0):
            break
    if align == "offset" and not doubt:
        doubt = _drifts(data_of(late), lag_of, start)
    return Aligned(late, errors, doubt, moves)


def _drifts(data: Data, lag_of: Callable[[Data], tuple[float, float]], start: float) -> str:
    """Return what is wrong with one offset for all of a record: its clocks run at different speeds, as lags of its parts say."""
    lags, middles = _lags_of_parts(data, lag_of, start)
    (_, drift), (_, error), _ = _line(middles, lags, "drift")
    if not abs(drift) > _SURE * error:
        return ""
    return (
        f"the clocks of angle and torque seem to run at different speeds: stamps of the torque become {abs(drift):.2g} ± {error:.1g} s "
        f"{'later' if drift > 0 else 'earlier'} each second; give align='drift'"
    )


def _lags_of_parts(
    data: Data, lag_of: Callable[[Data], tuple[float, float]], start: float
) -> tuple[list[tuple[float, float]], list[float]]:
    """Return the lags of parts of a record with their errors, and the times in the middle of each, from a start on."""
    count = max(2, min(_PARTS, data.time.size // _SHORTEST))
    parts = [_part(data, part, count) for part in range(count)]
    return [lag_of(part) for part in parts], [float(part.time.mean()) - start for part in parts]


def _part(data: Data, part: int, parts: int) -> Data:
    """Return one of several parts of a record."""
    if parts == 1:
        return data
    samples = data.time.size
    some = slice(samples * part // parts, samples * (part + 1) // parts)
    angles = data.angles[..., some]
    return replace(
        data,
        angles=angles,
        torques=data.torques[..., some],
        motion=replace(data.motion, angles=angles),
        time=data.time[some],
        mask=None,
        weights=None if data.weights is None else data.weights.part((..., some)),
        labels=None,
    )


def _line(
    middles: Sequence[float], lags: Sequence[tuple[float, float]], align: str
) -> tuple[Late, Late, tuple[Late, ...]]:
    """Return the line through lags, its errors, which know how far the lags are from it, and those that are independent of each other."""
    there = [
        (at, lag, error) for at, (lag, error) in zip(middles, lags, strict=True) if math.isfinite(lag) and error > 0
    ]
    if len(there) < (1 if align == "offset" else 2):
        return (math.nan, math.nan), (math.nan, math.nan), ()
    at, values, errors = (np.array(one) for one in zip(*there, strict=True))
    columns = np.stack([np.ones_like(at), at], axis=1)[:, : 1 if align == "offset" else 2]
    weighted = columns / errors[:, np.newaxis]
    covariance = np.linalg.pinv(weighted.T @ weighted)
    found = covariance @ weighted.T @ (values / errors)
    left = values - columns @ found
    free = at.size - columns.shape[1]
    if free > 0:
        covariance *= max(1.0, float(np.sum((left / errors) ** 2)) / free)
    padded = np.zeros((2, 2))
    padded[: len(found), : len(found)] = covariance
    sizes, directions = np.linalg.eigh(padded)
    moves = (np.sqrt(np.maximum(sizes, 0.0)) * directions).T.tolist()
    offset, drift = [*found.tolist(), 0.0][:2]
    of_offset, of_drift = np.sqrt(np.diag(padded)).tolist()
    return (offset, drift), (of_offset, of_drift), tuple((one, other) for one, other in moves if one or other)


def _coarse(angle: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> tuple[int, float]:
    """Return by how many samples the torque is late, about, and what that leaves unexplained over the middle of all other alignments.

    The equation of motion in weak form by least squares at every alignment: correlations with orthonormal columns. All is constant but the
    stiffness: where that varies by much and all were constant, a wrong alignment could leave less than the right one.
    """
    there = np.flatnonzero(np.isfinite(angle) & np.isfinite(torque))
    samples = 0 if there.size == 0 else int(there[-1] - there[0]) + 1
    if samples < _SHORTEST_SEARCH:
        return 0, math.inf
    both = slice(there[0], there[-1] + 1)
    angle, torque = _filled(angle[both]), _filled(torque[both])
    farthest = int(_FARTHEST * samples)
    half = _half_width(angle)
    x = np.arange(-half, half + 1) / half
    inside = 1 - x**2
    kernels = [inside**6, 12 * x * inside**5, 12 * inside**4 * (11 * x**2 - 1)]
    columns = [_convolved(angle, kernel) for kernel in kernels]
    filtered = _convolved(torque, kernels[0])
    rows = slice(farthest, columns[0].size - farthest)
    count = columns[0][rows].size
    turns = np.linspace(0.0, np.pi, count)
    varying = [columns[0][rows] * np.cos(number * turns) for number in range(1, min(_VARIES, count // _ROWS) + 1)]
    design = np.stack([*(column[rows] for column in columns), np.ones(count), *varying], axis=1)
    basis, _ = np.linalg.qr(design / np.linalg.norm(design, axis=0))
    size = 1 << (filtered.size + design.shape[0]).bit_length()
    spectrum = np.fft.rfft(filtered, size)
    count = 2 * farthest + 1
    explained, of_constants = np.zeros(count), np.zeros(count)
    for number, column in enumerate(basis.T):
        products = np.fft.irfft(spectrum * np.conj(np.fft.rfft(column, size)), size)[:count]
        explained += products**2
        of_constants += products**2 * (number <= len(columns))
    squares = np.concatenate([[0.0], np.cumsum(filtered**2)])
    energy = squares[design.shape[0] : design.shape[0] + count] - squares[:count]
    left, left_by_constants = (1 - one / np.maximum(energy, np.finfo(float).tiny) for one in (explained, of_constants))
    # What varies follows a wrong alignment nearly as well as clocks that drift leave the right one.
    best, by_constants = int(left.argmin()), int(left_by_constants.argmin())
    if left[by_constants] < _AS_GOOD * left[best]:
        left, best = left_by_constants, by_constants
    return best - farthest, float(left[best] / max(float(np.median(left)), np.finfo(float).tiny))


def _half_width(angle: Numbers) -> int:
    """Return half a typical cycle in samples."""
    changes = np.diff(angle, n=2)
    smooth = angle - angle.mean()
    power, faster = float(smooth @ smooth), float(np.diff(angle) @ np.diff(angle))
    # Noise makes neighbours differ too; a second difference of six times the variance of white noise tells how much.
    noise = float(changes @ changes) / 6
    frequency = math.sqrt(max(faster - 2 * noise, 0.0) / max(power, np.finfo(float).tiny))
    return int(np.clip(math.pi / max(frequency, 1e-9), 8, max(8, angle.size // 16)))


def _filled(values: npt.NDArray[np.number]) -> Numbers:
    there = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(values.size), there, values[there].astype(np.float64))


def _convolved(values: Numbers, kernel: Numbers) -> Numbers:
    """Return the sums where the kernel lies within the record."""
    size = 1 << (values.size + kernel.size).bit_length()
    product = np.fft.irfft(np.fft.rfft(values, size) * np.fft.rfft(kernel, size), size)
    return product[kernel.size - 1 : values.size]
