"""Velocity and acceleration beside the angle, or in its place: what they are biased by, and whether they belong to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._clocks import Passed
from tvident._status import stretches_of

_Numbers = npt.NDArray[np.float64]

DERIVATIVES = {"velocity": 1, "acceleration": 2}
"""Channels of the motion beside the angle, and which derivative each is."""

_SHORTEST = 50
"""Samples without a gap that a bias is estimated from, at least."""

_BLOCKS = 8
"""Parts of a record whose biases are compared."""

_WIDTHS = (16, 64, 256, 1024)
"""Samples over which a channel is compared with the derivative of another; the width with the least error is taken."""

_FEWEST = 20
"""Comparisons that a factor between channels is estimated from, at least."""

_CHANCE, _DIFFERENT = 5.0, 0.02
"""A channel belongs to another unit where the factor differs from one by more than so many standard errors, and by more than this part."""

_UNITS = {
    180 / math.pi: "it seems to be in degrees: divide it by 57.29578",
    30 / math.pi: "it seems to be in turns a minute: multiply it by 0.1047198",
    1 / (2 * math.pi): "it seems to be in turns: multiply it by 6.283185",
    -1.0: "its sign is the other one",
    1 / 9.80665: "it seems to be in multiples of g: multiply it by 9.80665, over the radius in m",
}
"""Factors that tell the unit."""


_LEAST_NOISE = {1: 1e-5, 2: 1e-6}
"""Noise of a derivative over that of the other channel, in the unit of a sample, below which less makes no difference but to rounding."""


@dataclass(frozen=True)
class MotionChannels:
    r"""The motion of some records: one angle, and what it was made of.

    Parameters
    ----------
    angles : ndarray, shape (\\*, n)
        Measured, fused with its derivatives, or integrated. NaN where any channel is missing.
    recorded : mapping of str to ndarray, shape (\\*, n)
        The channels that it was made of, without their biases; empty where the angle was measured alone.
    noise : list of (float, int, list of (int, float)), optional
        Of every record what the core is to know of the noise: the variance of the first channel, how often it was integrated, and which
        derivatives it was fused with, each with its noise.
    biases : mapping of str to (values, errors)
        One number a record, by the name of the constant.
    doubts : list of (int, str)
        What is wrong with a channel, and of which record.
    """

    angles: npt.NDArray[np.number]
    recorded: Mapping[str, _Numbers] = field(default_factory=dict)
    noise: list[tuple[float, int, list[tuple[int, float]]]] | None = None
    biases: Mapping[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    doubts: list[tuple[int, str]] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """What was recorded of the motion."""
        return list(self.recorded) or ["angle"]

    def part(self, place: Any, batch: tuple[int, ...]) -> MotionChannels:
        """Return the channels of some records of a batch; what was said of them is said."""
        records = np.arange(int(np.prod(batch, dtype=int))).reshape(batch)[place].ravel().tolist()

        def some(values: list[Any]) -> list[Any]:
            return [values[record] for record in records]

        return MotionChannels(
            self.angles[place],
            {name: values[place] for name, values in self.recorded.items()},
            None if self.noise is None else some(self.noise),
            {name: (some(values), some(errors)) for name, (values, errors) in self.biases.items()},
        )


def motion_channels(
    given: Mapping[str, npt.NDArray[np.number]],
    period: float,
    *,
    has_spring: bool,
    quantisation: float | None,
    passed: Passed | None = None,
    weights: npt.NDArray[np.float64] | None = None,
) -> MotionChannels:
    """Return one angle from what was measured of a motion.

    Parameters
    ----------
    given : mapping of str to ndarray
        Angle, velocity and acceleration as far as they are there, in this order and of one shape.
    period : float
        Seconds from one sample to the next.
    has_spring : bool
        Whether the equation asks for the angle: then the mean of a velocity without an angle is its bias.
    quantisation : float, optional
        Step to which the angle was rounded.
    passed : Passed, optional
        What became of white noise where channels were resampled.
    weights : ndarray of the same shape, optional
        Of samples, of all channels: noise is that of a sample of weight one.
    """
    if list(given) == ["angle"]:
        return MotionChannels(given["angle"])
    arrays = {name: np.array(values, dtype=np.float64) for name, values in given.items()}
    missing = np.any([~(np.abs(values) <= arguments.LARGEST) for values in arrays.values()], axis=0)
    for values in arrays.values():
        values[missing] = np.nan
    (source, first), *others = arrays.items()
    integrations = DERIVATIVES.get(source, 0)
    shape = missing.shape[:-1]
    biases: dict[str, tuple[list[float], list[float]]] = {}
    doubts: list[tuple[int, str]] = []
    sigmas = _sigmas(first, quantisation if source == "angle" else None, passed, weights)
    beside: list[list[tuple[int, float, _Numbers]]] = [[] for _ in sigmas]
    for name, values in others:
        order = DERIVATIVES[name] - integrations
        noises = _sigmas(values, None, passed, weights)
        found = _judged_all(first, values, (order, period), (sigmas, noises))
        wrong = [record for record, one in enumerate(found) if one.words]
        if wrong:
            doubts += [
                (record, f"the {name} {found[record].words} of the {source}; it is left out") for record in wrong
            ]
            del arrays[name]
            continue
        biases[f"{name}_bias"] = ([one.bias for one in found], [one.error for one in found])
        arrays[name] = values - np.array(biases[f"{name}_bias"][0]).reshape(*shape, 1)
        for record, (sigma, spread) in enumerate(zip(sigmas, noises, strict=True)):
            if sigma > 0:
                relative = max(spread * period**order / sigma, _LEAST_NOISE[order])
                beside[record].append((order, relative, _records(arrays[name])[record]))
    fused = _fused(first, beside, period)
    if integrations > 1 and has_spring:
        words = (
            "the angle is integrated twice from an acceleration, and drifts: trust the inertia, and the stiffness where the motion is "
            "fast; measure a velocity or an angle, too"
        )
        doubts += [(record, words) for record in range(len(sigmas))]
    if integrations:
        fused, means = _integrated(fused, integrations, period, centred=has_spring, sigmas=sigmas)
        if has_spring:
            first -= np.array(means[0]).reshape(*shape, 1)
            biases[f"{source}_bias"] = means
    noise = [
        (sigma**2, integrations, [(order, relative) for order, relative, _ in more])
        for sigma, more in zip(sigmas, beside, strict=True)
    ]
    return MotionChannels(fused, arrays, noise, biases, doubts)


def _fused(first: _Numbers, beside: Sequence[list[tuple[int, float, _Numbers]]], period: float) -> _Numbers:
    """Return the most likely motion of every record."""
    fused = first.copy()
    for record, more in zip(_records(fused), beside, strict=True):
        if more:
            record[:] = _core.fuse(record.copy(), more, period)
    return fused


def _judged_all(
    first: _Numbers, other: _Numbers, derivative: tuple[int, float], noises: tuple[Sequence[float], Sequence[float]]
) -> list[_Judged]:
    """Return what is known of a channel of every record beside another."""
    pairs = zip(_records(first), _records(other), zip(*noises, strict=True), strict=True)
    return [_Pair(reference, channel, *derivative, both).judged() for reference, channel, both in pairs]


def _records(array: _Numbers) -> _Numbers:
    return array.reshape(-1, array.shape[-1])


def _integrated(
    source: _Numbers, times: int, period: float, *, centred: bool, sigmas: Sequence[float]
) -> tuple[_Numbers, tuple[list[float], list[float]]]:
    """Integrate records some times, without their means where they are to stay bounded; return the means and their errors, too.

    The mean of what a bounded motion has for a derivative is its bias, but for what lies between its ends.
    """
    found, means, errors = np.empty_like(source), [], []
    for record, target, sigma in zip(_records(source), _records(found), sigmas, strict=True):
        there = np.flatnonzero(np.isfinite(record))
        if not there.size:
            target[:] = np.nan
            means.append(math.nan)
            errors.append(math.nan)
            continue
        places = np.arange(record.size)
        values = np.interp(places, there, record[there])
        mean, error = float(record[there].mean()), math.nan
        for time in range(times):
            values = _sums(values - values.mean() if centred else values, period)
            if time == 0:
                spread = float(np.std(values)) * math.sqrt(2) / (period * record.size)
                error = math.hypot(spread, sigma / math.sqrt(there.size))
        target[:] = values
        target[~np.isfinite(record)] = np.nan
        means.append(mean)
        errors.append(error)
    return found, (means, errors)


def _sums(values: _Numbers, period: float) -> _Numbers:
    """Return the integral up to every sample, of cubics through four samples."""
    if values.size < 4:  # noqa: PLR2004 - samples of a cubic
        return np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2)]) * period
    wide = np.pad(values, 1, mode="reflect", reflect_type="odd")
    steps = (13 * (wide[1:-2] + wide[2:-1]) - wide[:-3] - wide[3:]) / 24
    return np.concatenate([[0.0], np.cumsum(steps)]) * period


def _sigmas(
    channel: _Numbers,
    quantisation: float | None,
    passed: Passed | None,
    weights: npt.NDArray[np.float64] | None,
) -> list[float]:
    """Return the standard deviation of a channel's noise in every record; 0 where nothing tells it."""
    records = _records(channel)
    own = [None] * len(records) if weights is None else _records(weights)
    return [_sigma(record, quantisation, passed, one) for record, one in zip(records, own, strict=True)]


def _sigma(
    record: _Numbers, quantisation: float | None, passed: Passed | None, weights: npt.NDArray[np.float64] | None
) -> float:
    """Return that of one record."""
    try:
        noise = None if passed is None else passed.noise
        sigma = _core.noise(np.ascontiguousarray(record), quantisation, noise, weights)[0].sigma
    except ValueError:  # the record is too short
        return 0.0
    return sigma if math.isfinite(sigma) else 0.0


@dataclass(frozen=True)
class _Judged:
    """What is known of a channel beside another: its bias with its standard error, and what is wrong with it."""

    bias: float
    error: float
    words: str = ""


@dataclass(frozen=True)
class _Pair:
    """A channel and another, of which it is a derivative."""

    reference: _Numbers
    channel: _Numbers
    order: int
    period: float
    noises: tuple[float, float]

    @np.errstate(all="ignore")  # of numbers at the limits of doubles nothing is known
    def judged(self) -> _Judged:
        """Return the bias of the channel, or what is wrong with it."""
        noises = self.noises
        stretches = self._stretches()
        if not stretches:
            return _Judged(0.0, math.nan)
        bias, variance = self._bias(stretches, noises)
        blocks = [part for stretch in stretches for part in self._parts(stretch)]
        if len(blocks) > 1:
            # Noise that is not white makes the parts differ more.
            each = [self._bias([part], noises) for part in blocks]
            squares = sum((one - bias) ** 2 / max(own, np.finfo(float).tiny) for one, own in each)
            variance *= max(1.0, squares / (len(blocks) - 1))
        return _Judged(bias, math.sqrt(variance), self._factor(bias, noises))

    def _stretches(self) -> list[tuple[int, int]]:
        begins, ends = stretches_of(np.isfinite(self.reference))
        pairs = zip(begins.tolist(), ends.tolist(), strict=True)
        return [(first, end) for first, end in pairs if end - first >= _SHORTEST]

    def _parts(self, stretch: tuple[int, int]) -> list[tuple[int, int]]:
        first, end = stretch
        count = max(1, min(_BLOCKS, (end - first) // (2 * _SHORTEST)))
        return list(pairwise([first + (end - first) * part // count for part in range(count + 1)]))

    def _bias(self, stretches: Sequence[tuple[int, int]], noises: tuple[float, float]) -> tuple[float, float]:
        """Return the constant by which the channel differs from the derivative, and its variance."""
        sums, weights = 0.0, 0.0
        for first, end in stretches:
            window, derivative = _bell(end - first, self.order, self.period)
            reference = self.reference[first:end]
            total = window.sum()
            motion = derivative @ (reference - reference.mean())
            value = (window @ self.channel[first:end] - motion) / total
            variance = noises[1] ** 2 * (window @ window) + noises[0] ** 2 * (derivative @ derivative)
            weight = total**2 / max(variance, np.finfo(float).tiny)
            sums, weights = sums + weight * value, weights + weight
        return float(sums / weights), float(1 / weights)

    def _factor(self, bias: float, noises: tuple[float, float]) -> str:
        """Return in words by how much the channel differs from the derivative; nothing if it does not."""
        best: tuple[float, float] | None = None
        for width in _WIDTHS:
            if width * _FEWEST > self.channel.size:
                break
            window, derivative = _bell(width, self.order, self.period)
            pieces = self.channel.size // width
            measured = self.channel[: pieces * width].reshape(pieces, width) @ window - bias * window.sum()
            known = self.reference[: pieces * width].reshape(pieces, width)
            known = (known - known[:, :1]) @ derivative
            there = np.isfinite(known) & np.isfinite(measured)
            known, measured = known[there], measured[there]
            noise = noises[0] ** 2 * float(derivative @ derivative)
            power = float(known @ known) - known.size * noise
            if known.size < _FEWEST or power <= known.size * noise:
                continue
            factor = float(known @ measured) / power
            left = measured - factor * known
            error = math.sqrt(float(left @ left) / (known.size - 1) / power)
            if best is None or error < best[1]:
                best = (factor, error)
        if best is None:
            return ""
        factor, error = best
        if abs(factor - 1) <= max(_CHANCE * error, _DIFFERENT):
            return ""
        near = [
            words
            for one, words in _UNITS.items()
            if abs(factor / one - 1) <= max(_CHANCE * error / abs(one), _DIFFERENT)
        ]
        what = "derivative" if self.order == 1 else "second derivative"
        return f"is {factor:.4g} times the {what}{f' ({near[0]})' if near else ''}"


def _bell(length: int, order: int, period: float) -> tuple[_Numbers, _Numbers]:
    """Return a window that rises smoothly in the first third and falls in the last, and the kernel that takes the derivative in it.

    By parts, ``sum(window * derivative of x) = sum(kernel * x)``, for a motion that the samples resolve.
    """
    third = length / 3
    x = np.arange(length) + 0.5
    rises, falls = np.clip(x / third, 0, 1), np.clip((length - x) / third, 0, 1)
    step = third * period

    def smooth(u: _Numbers) -> tuple[_Numbers, _Numbers, _Numbers]:
        inside = u * (1 - u)
        return (
            u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3),
            140 * inside**3 / step,
            420 * inside**2 * (1 - 2 * u) / step**2,
        )

    up, down = smooth(rises), smooth(falls)
    window = up[0] * down[0]
    kernel = down[1] - up[1] if order == 1 else up[2] + down[2]
    kernel -= kernel.sum() / window.sum() * window
    return window, kernel


def constants_of(channels: MotionChannels, shape: tuple[int, ...]) -> dict[str, tuple[Any, Any]]:
    """Return biases as results have them: numbers for a single record, arrays in the batch's shape otherwise."""
    return {
        name: (np.array(values).reshape(shape), np.array(errors).reshape(shape)) if shape else (values[0], errors[0])
        for name, (values, errors) in channels.biases.items()
    }
