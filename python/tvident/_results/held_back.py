"""How much of a part of the record that was held back the model explains."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments import explained_in_words
from tvident._equation import COEFFICIENTS, OFFSET
from tvident._results.response import Model, accounted_for, without_gaps

PARTS = 10
"""The last tenth of each is held back."""

_SHARE = 0.1

_STRETCH, _OF_STRETCH = 1 << 15, 100
"""Samples, and test functions, of a stretch at the end of each part: a record that is twice as long as ten of them is told by these."""

_NEAR = 3
"""Tenths of a stretch that are identified, of which the middle one is held back: what is farther away says little of it."""

_SUDDEN = 0.1
"""The share of the parts that may hold a sudden change, which no model that was fitted beside it can foresee."""

MORE_PARTS = 64
"""Of which the ends are held back where equations are compared."""

_FUNCTIONS = 10
"""Test functions that a part must be long, so that the held-back tenth of it is as long as one."""


@dataclass(frozen=True)
class HeldBack:
    r"""What a model explains of samples that it was not fitted to, in percent of the variance of their angle.

    Parameters
    ----------
    simulated : float or ndarray, shape (\*)
        From the state before a held-back part to its end.
    predicted : float or ndarray, shape (\*)
        One test function ahead.
    parts : int
        Parts of the record whose last tenth was held back: ten, or fewer in a short record.
    why_not : str
        Why there are no numbers; empty if there are.
    ahead : float
        Seconds that a test function is long: what was predicted with a longer one cannot be compared with what was with a shorter one.
    steady : float
        As `predicted`, without the tenth of the parts that are predicted worst; of a single record.
    stretch : float
        Seconds of each stretch at the end of a part of a long record, of which a tenth was held back in place of that of the whole part;
        NaN of a shorter one.
    """

    simulated: Any = np.nan
    predicted: Any = np.nan
    parts: int = PARTS
    why_not: str = ""
    ahead: float = np.nan
    steady: float = np.nan
    stretch: float = np.nan

    def words(self) -> str:
        """Return it as a line."""
        if self.why_not:
            return f"how much of a held-back part the model explains is not known: {self.why_not}"
        several = np.ndim(self.simulated) > 0
        simulated, predicted = (
            explained_in_words(float(np.nanmedian(one)) / 100) for one in (self.simulated, self.predicted)
        )
        whose = " (median of all records)" if several else ""
        return (
            f"explains {simulated} of the angle simulated and {predicted} predicted one test function ahead{self._seconds()} in "
            f"{where_held_back(self.parts, self.stretch)}, "
            f"held back from the fit{whose}"
        )

    def _seconds(self) -> str:
        """Return how far ahead that is, in words."""
        if not np.isfinite(self.ahead):
            return ""
        return f" ({self.ahead:.3g} s)" if self.ahead >= 1 else f" ({1e3 * self.ahead:.3g} ms)"


def where_held_back(parts: int, stretch: float = np.nan) -> str:
    """Return what was held back of so many parts, or of a stretch of so many seconds at the end of each."""
    if np.isfinite(stretch):
        return f"a tenth of the last {stretch:.3g} s of every tenth"
    few = {PARTS: "the last tenth of every tenth", 1: "the last tenth"}
    return few.get(parts, f"the last tenth of each of {parts} parts")


def parts_of(samples: int, window_length: int, most: int = PARTS) -> list[tuple[int, int, int]]:
    """Return the parts of a record, at most so many: first sample, first that is held back, end."""
    count = min(most, max(1, samples // (_FUNCTIONS * window_length)))
    ends = [round(samples * part / count) for part in range(count + 1)]
    return [(begin, end - max(1, round(_SHARE * (end - begin))), end) for begin, end in pairwise(ends)]


def without_masked(
    parts: list[tuple[int, int, int]], mask: npt.NDArray[np.bool_] | None, window_length: int
) -> list[tuple[int, int, int]]:
    """Return the parts without what a mask leaves out of all records, where something else may act: behind it a state from before is wrong.

    Each begins behind the last such sample before what is held back, a test function earlier at least, and ends before the first one in
    it. Where that leaves nothing of any part, all stay whole.
    """
    if mask is None:
        return parts
    out = np.logical_not(np.any(mask.reshape(-1, mask.shape[-1]), axis=0)).ravel()
    kept = []
    for begin, first, end in parts:
        before, inside = np.flatnonzero(out[begin:first]), np.flatnonzero(out[first:end])
        start = begin + int(before[-1]) + 1 if before.size else begin
        stop = first + int(inside[0]) if inside.size else end
        if stop > first and first - start >= min(window_length, first - begin):
            kept.append((start, first, stop))
    return kept or parts


def stretch_of(window_length: int) -> int:
    """Return the samples of a stretch at the end of each part of a long record."""
    return max(_STRETCH, _OF_STRETCH * window_length)


def ends_of_stretches(samples: int, window_length: int) -> list[slice]:
    """Return the last tenths of the stretches that tell of a long record; nothing of a short one."""
    length = stretch_of(window_length)
    if samples < 2 * PARTS * length:
        return []
    ends = (round(samples * part / PARTS) for part in range(1, PARTS + 1))
    return [slice(end - _NEAR * round(_SHARE * length), end) for end in ends]


def held_back_of(samples: int) -> tuple[int, int, int]:
    """Return what is held back of the last tenths of a stretch, as :func:`parts_of` does: between what is known on both sides."""
    return 0, samples // _NEAR, samples - samples // _NEAR


def responses_of(
    model: Model,
    angle: npt.NDArray[np.number],
    torque: npt.NDArray[np.number],
    parts: list[tuple[int, int, int]],
    window_length: int,
    *,
    simulated: bool = True,
) -> Iterator[npt.NDArray[np.float64]]:
    """Return the angle that a model of the rest simulates, if asked for, and the one that it predicts, at the ends of the parts."""
    pieces, whole = [], []
    # Where a term is not linear the state takes many simulations; the last ten test functions tell it.
    is_linear = set(model.values) <= {*COEFFICIENTS, OFFSET}
    for begin, first, end in parts:
        before = min(window_length, first - begin)
        whole.append((begin if is_linear else max(begin, first - _FUNCTIONS * window_length), first, end))
        pieces += [(start - before, start, min(start + before, end)) for start in range(first, end, max(1, before))]
    # A part that was held back has no parameters of its own.
    values = {name: without_gaps(value) if value.shape[-1] > 1 else value for name, value in model.values.items()}
    model = replace(model, values=values)
    # What a piece tells of its first half is no prediction: the piece before overwrites it.
    for spans in (whole, pieces[::-1]) if simulated else (pieces[::-1],):
        yield model.respond(torque, angle=angle, spans=spans)[0]


def judged(
    angle: npt.NDArray[np.number],
    responses: Iterable[npt.NDArray[np.float64]],
    parts: list[tuple[int, int, int]],
    *,
    simulated: bool = True,
) -> HeldBack:
    """Return what responses explain of the ends of the parts: the angle that was simulated, if it was, and the one that was predicted."""
    held = _held(angle, parts)
    shares, response = [], np.empty(0)
    for response in responses:
        share = accounted_for(angle[..., held], response[..., held])
        shares.append(share if share.ndim else float(share))
    if not np.isfinite(shares[0]).any():
        return HeldBack(why_not="no sample that was held back has an angle and parameters")
    steady = _without_the_worst(angle, response, parts) if angle.ndim == 1 else np.nan
    return HeldBack(shares[0] if simulated else np.nan, shares[-1], len(parts), steady=steady)


@np.errstate(all="ignore")  # of samples beyond doubles nothing is predicted
def _without_the_worst(
    angle: npt.NDArray[np.number], predicted: npt.NDArray[np.float64], parts: list[tuple[int, int, int]]
) -> float:
    """Return the share of the variance that is predicted of the parts, without those that are predicted worst, in percent."""
    squares = np.nan_to_num((angle - predicted) ** 2, nan=np.inf)
    errors = [squares[first:end].mean() for _, first, end in parts]
    kept = np.argsort(errors)[: len(parts) - int(_SUDDEN * len(parts))]
    there = _held(angle, [parts[place] for place in kept])
    return float(accounted_for(angle[there], predicted[there]))


def _held(angle: npt.NDArray[np.number], parts: list[tuple[int, int, int]]) -> npt.NDArray[np.bool_]:
    """Return which samples are held back of the parts."""
    held = np.zeros(angle.shape[-1], bool)
    for _, first, end in parts:
        held[first:end] = True
    return held
