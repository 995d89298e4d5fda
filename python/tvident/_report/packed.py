"""Series packed for a page: the least and greatest sample of every block, and where each sample lies between them.

A page that shows an hour has some 1000 columns, so it begins with the blocks' extremes and needs samples only after zooming in. Levels
within a block rather than levels of the whole series: beside a spike of a thousand times the signal 65 536 levels of the whole would show
the signal as steps. Levels have 16 bits, or as many as there is room for: an hour of five channels that are noise has room for 7, which is
as fine as a screen.
"""

from __future__ import annotations

import base64
import os
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

BLOCK = 128
"""Samples: fewer make extremes cost more than levels, more make levels coarse where the series changes."""

_MOST_BITS, _LEAST_BITS = 16, 7
"""Of a level, of which the last two say that a sample is the greatest, and that there is none."""

_ONE_BYTE = 254
"""The highest level that leaves one for samples that are missing, in a byte."""

_MOST_BYTES = 16_950_000
"""Of all series, packed. As text that is 22.6 MB, which leaves room for plotly in 25 MB."""

_SHRINK = 64
"""What is computed from channels is made so many times smaller than these before they lose samples themselves."""

_MOST_THREADS = 4

_CHUNK = 1 << 16
"""Samples that are worked on together: what they need stays in the cache."""

_SHORT = 32
"""Samples of a row: NumPy looks for the extremes of many rows so short in half of the time if the rows lie side by side."""

_LOOKED_AT, _EXTREMES_LOOKED_AT = 256, 64
"""Blocks that tell how well a series compresses: of samples, and of extremes, for which many more samples are read."""

_HUGE = 1e300
"""Numbers beyond are missing: their differences would overflow."""


@dataclass(frozen=True)
class Computed:
    """Numbers that are computed a part at a time: a whole record of them takes longer to be put somewhere than to be computed.

    Parameters
    ----------
    size : int
    part : callable
        Gives some of them; NumPy says nothing of what is no number.
    """

    size: int
    part: Callable[[slice], npt.NDArray[Any]]

    def __getitem__(self, some: slice) -> npt.NDArray[Any]:
        return self.part(some)


@dataclass(frozen=True)
class Series:
    """Numbers at equal distances in time.

    Parameters
    ----------
    name, unit : str
    values : ndarray, shape (n,), or Computed
        What is not finite is missing.
    start, period : float
        Time of the first number, and from one to the next, in seconds.
    is_recorded : bool
        Whether it is a channel: where not all fits, its samples stay longest.
    """

    name: str
    unit: str
    values: npt.NDArray[Any] | Computed
    start: float
    period: float
    is_recorded: bool = False


@dataclass(frozen=True)
class Packed:
    """A series as a page holds it.

    Parameters
    ----------
    about : dict
        What the page must know to unpack it, plain JSON.
    extremes, levels : str
        gzip, as base64.
    """

    about: dict[str, Any]
    extremes: str
    levels: str


def packed(series: Sequence[Series], most_bytes: int = _MOST_BYTES) -> list[Packed]:
    """Return series packed: where samples do not fit, the finest level is of their extremes."""
    top, sizes = _finest(series, most_bytes)
    merged = [1] * len(sizes)
    while sum(sizes) > most_bytes:
        largest = int(
            np.argmax([size if one.is_recorded else _SHRINK * size for one, size in zip(series, sizes, strict=True)])
        )
        # Two numbers stand for four samples at first, and for twice as many each time.
        every = merged[largest] = max(4, 2 * merged[largest])
        sizes[largest] = _size(series[largest], _some_blocks(series[largest], every), top, every)
    # Nearly all of the work is NumPy's and zlib's, which let other threads run.
    with ThreadPoolExecutor(min(_MOST_THREADS, os.cpu_count() or 1)) as pool:
        return list(pool.map(_packed, series, [top] * len(sizes), merged))


def in_words(parts: Sequence[Packed]) -> str:
    """Return what a page says of how near its plots are to the samples; nothing of a page without plots."""
    if not parts:
        return ""
    levels = f"one of {parts[0].about['top'] + 1:,} levels between the extremes of {BLOCK} neighbours".replace(",", " ")
    of_extremes = [one.about["name"] for one in parts if one.about["merged"] > 1]
    if not of_extremes:
        return f"Every sample is in this page, as {levels}."
    return (
        "The record is too long for every sample to be in this page: "
        f"of {len(of_extremes)} of {len(parts)} series it has the least and the greatest of every few, each as {levels}."
    )


def _finest(series: Sequence[Series], most_bytes: int) -> tuple[int, list[float]]:
    """Return the highest level of the most bits that fit, and how many bytes each series takes with them."""
    some = [_some_blocks(one, 1) for one in series]

    def sizes(bits: int) -> list[float]:
        return [_size(one, blocks, _highest(bits), 1) for one, blocks in zip(series, some, strict=True)]

    found = sizes(_LEAST_BITS)
    if sum(found) > most_bytes:
        return _highest(_LEAST_BITS), found
    fit, too_many = _LEAST_BITS, _MOST_BITS + 1
    while too_many - fit > 1:
        bits = (fit + too_many) // 2
        if sum(larger := sizes(bits)) <= most_bytes:
            fit, found = bits, larger
        else:
            too_many = bits
    return _highest(fit), found


def _highest(bits: int) -> int:
    return (1 << bits) - 2


def _count(series: Series, merged: int) -> int:
    """Return the numbers of a series: its samples, or the extremes of so many."""
    return series.values.size if merged == 1 else 2 * -(-series.values.size // merged)


def _size(series: Series, some: Array, top: int, merged: int) -> float:
    """Return the bytes that a series takes, packed as it is or by the extremes of so many samples; some blocks tell."""
    levels = _levels(some, top)[2]
    bits = min(_entropy(levels), _entropy(_differences(levels)))
    return _count(series, merged) * (bits / 8 + 8 / BLOCK)


def _width(merged: int) -> int:
    """Return the samples that a block stands for."""
    return BLOCK if merged == 1 else BLOCK // 2 * merged


@np.errstate(all="ignore")
def _some_blocks(series: Series, merged: int) -> Array:
    """Return blocks that tell how well a series compresses."""
    width = _width(merged)
    whole = max(1, series.values.size // width)
    chosen = range(0, whole, max(1, whole // (_LOOKED_AT if merged == 1 else _EXTREMES_LOOKED_AT)))
    samples = np.concatenate([_samples(series, width * one, width) for one in chosen])
    return _blocks(samples, merged)


def _samples(series: Series, first: int, count: int) -> Array:
    """Return some samples; those behind the end are NaN."""
    samples = np.asarray(series.values[first : first + count], np.float64)
    lacking = count - samples.size
    return np.append(samples, np.full(lacking, np.nan)) if lacking else samples


def _blocks(samples: Array, merged: int) -> Array:
    """Return samples as blocks, or their extremes: the least and the greatest of every so many, in turns."""
    if merged == 1:
        return samples.reshape(-1, BLOCK)
    low, high, _ = _extremes(samples.reshape(-1, merged))
    return np.stack([low, high], axis=1).reshape(-1, BLOCK)


def _extremes(rows: Array) -> tuple[Array, Array, Array]:
    """Return the least and the greatest of every row, and the rows with NaN where something is missing or beyond what is shown."""
    table, axis = (np.ascontiguousarray(rows.T), 0) if rows.shape[1] <= _SHORT else (rows, 1)
    low, high = table.min(axis=axis), table.max(axis=axis)
    if not (low.min() > -_HUGE and high.max() < _HUGE):
        table = np.where(np.abs(table) < _HUGE, table, np.nan)
        rows = table if axis == 1 else table.T
        low, high = np.fmin.reduce(table, axis=axis), np.fmax.reduce(table, axis=axis)
    return low, high, rows


def _levels(blocks: Array, top: int) -> tuple[Array, Array, npt.NDArray[Any]]:
    """Return the extremes of every block, and where its samples lie between them."""
    low, high, rows = _extremes(blocks)
    reach = high - low
    with np.errstate(over="ignore", invalid="ignore"):
        scale = np.divide(top, reach, out=np.zeros_like(reach), where=reach > 0)
        levels = rows - low[:, np.newaxis]
        levels *= scale[:, np.newaxis]
        levels += 0.5
    if rows is not blocks or not np.isfinite(scale).all():
        missing = np.isnan(levels)
        levels[missing] = top + 1
        np.minimum(levels, top + 1, out=levels)
    return low, high, levels.astype(_kind(top))


def _kind(top: int) -> type[np.unsignedinteger[Any]]:
    return np.uint16 if top > _ONE_BYTE else np.uint8


def _differences(levels: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return levels less those before, as numbers without sign do."""
    flat = levels.ravel()
    return np.concatenate([flat[:1], flat[1:] - flat[:-1]])


def _entropy(levels: npt.NDArray[Any]) -> float:
    """Return bits a level, as a code of bytes takes them."""
    planes = levels.ravel().view(np.uint8).reshape(levels.size, -1)
    total = 0.0
    for plane in planes.T:
        share = np.bincount(plane, minlength=256) / plane.size
        share = share[share > 0]
        total -= float((share * np.log2(share)).sum())
    return total


@np.errstate(all="ignore")
def _packed(series: Series, top: int, merged: int) -> Packed:
    numbers, width = _count(series, merged), _width(merged)
    count = -(-numbers // BLOCK)
    low, high, levels = np.empty(count), np.empty(count), np.empty((count, BLOCK), _kind(top))
    together = max(1, _CHUNK // width)
    for first in range(0, count, together):
        some = slice(first, min(count, first + together))
        samples = _samples(series, width * first, width * (some.stop - first))
        low[some], high[some], levels[some] = _levels(_blocks(samples, merged), top)
    # Single precision is enough for a distance from the middle, whatever the offset and the size.
    there = np.isfinite(low)
    bottom, ceiling = (float(low[there].min()), float(high[there].max())) if there.any() else (0.0, 0.0)
    middle, factor = bottom / 2 + ceiling / 2, (ceiling / 2 - bottom / 2) or 1.0
    extremes = (np.concatenate([low, high]) - middle) / factor
    seen = levels[:: max(1, count // _LOOKED_AT)]
    by_difference = count > 0 and _entropy(_differences(seen)) < _entropy(seen)
    flat = _differences(levels) if by_difference else levels.ravel()
    # Low bytes and high bytes apart: the high ones hardly change.
    planes = np.ascontiguousarray(flat.view(np.uint8).reshape(flat.size, -1).T)
    about = {
        "name": series.name,
        "unit": series.unit,
        "start": series.start,
        "period": series.period if merged == 1 else series.period * merged / 2,
        "count": numbers,
        "merged": merged,
        "block": BLOCK,
        "top": top,
        "middle": middle,
        "factor": factor,
        "differences": by_difference,
    }
    return Packed(about, text_of(extremes.astype("<f4").tobytes()), text_of(planes.tobytes()))


def text_of(content: bytes, level: int = 1, strategy: int = zlib.Z_RLE) -> str:
    """Return bytes as gzip in base64; runs and frequencies of bytes are all that a recording offers, and found fast."""
    packer = zlib.compressobj(level, zlib.DEFLATED, 31, 9, strategy)
    return base64.b64encode(packer.compress(content) + packer.flush()).decode()
