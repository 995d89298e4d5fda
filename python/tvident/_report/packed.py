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
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import reduce
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

_CHUNK = 4096
"""Blocks that are worked on together: what they need stays in the cache."""

_SHORT = 16
"""Samples of a row."""

_LOOKED_AT = 256
"""Blocks that tell how well a series compresses."""

_HUGE = 1e300
"""Numbers beyond are missing: their differences would overflow."""


@dataclass(frozen=True)
class Series:
    """Numbers at equal distances in time.

    Parameters
    ----------
    name, unit : str
    values : ndarray, shape (n,)
        What is not finite is missing.
    start, period : float
        Time of the first number, and from one to the next, in seconds.
    is_recorded : bool
        Whether it is a channel: where not all fits, its samples stay longest.
    """

    name: str
    unit: str
    values: npt.NDArray[Any]
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
        merged[largest] = max(4, 2 * merged[largest])
        sizes[largest] = _size(series[largest], top, merged[largest])

    def work(one: Series, every: int) -> Packed:
        return _packed(one if every == 1 else _of_extremes(one, every), top, every)

    # Nearly all of the work is NumPy's and zlib's, which let other threads run.
    with ThreadPoolExecutor(min(_MOST_THREADS, os.cpu_count() or 1)) as pool:
        return list(pool.map(work, series, merged))


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
    found = _sizes(series, _highest(_LEAST_BITS))
    if sum(found) > most_bytes:
        return _highest(_LEAST_BITS), found
    fit, too_many = _LEAST_BITS, _MOST_BITS + 1
    while too_many - fit > 1:
        bits = (fit + too_many) // 2
        sizes = _sizes(series, _highest(bits))
        if sum(sizes) <= most_bytes:
            fit, found = bits, sizes
        else:
            too_many = bits
    return _highest(fit), found


def _highest(bits: int) -> int:
    return (1 << bits) - 2


def _sizes(series: Sequence[Series], top: int) -> list[float]:
    return [_size(one, top, 1) for one in series]


def _size(series: Series, top: int, merged: int) -> float:
    """Return the bytes that a series takes, packed as it is or by the extremes of so many samples."""
    count = series.values.size if merged == 1 else 2 * -(-series.values.size // merged)
    return count * (_bits(series, top, merged) / 8 + 8 / BLOCK)


def _of_extremes(series: Series, every: int) -> Series:
    """Return the least and the greatest of every so many samples, in turns."""
    count = -(-series.values.size // every)
    whole = np.full(count * every, np.nan)
    whole[: series.values.size] = series.values
    return replace(series, values=_extremes(whole, every), period=series.period * every / 2)


def _extremes(values: npt.NDArray[Any], every: int) -> Array:
    """Return the least and the greatest of every so many numbers, in turns."""
    rows = values.reshape(-1, every)
    pairs = np.empty((len(rows), 2))
    for first in range(0, len(rows), _CHUNK):
        some = rows[first : first + _CHUNK]
        for end, extreme in enumerate((np.fmin, np.fmax)):
            # Of short rows column after column: NumPy reduces a row of four in ten times the time.
            pairs[first : first + _CHUNK, end] = (
                reduce(extreme, some.T) if every <= _SHORT else extreme.reduce(some, axis=1)
            )
    return pairs.ravel()


def _blocks(series: Series, first: int, last: int) -> Array:
    """Return some blocks as rows; missing numbers are NaN, and so is what the last block lacks."""
    samples = series.values[first * BLOCK : last * BLOCK].astype(np.float64)
    lacking = (last - first) * BLOCK - samples.size
    if lacking:
        samples = np.append(samples, np.full(lacking, np.nan))
    return _without_huge(samples.reshape(-1, BLOCK))


def _without_huge(samples: Array) -> Array:
    samples[~(np.abs(samples) < _HUGE)] = np.nan
    return samples


def _levels(rows: Array, low: Array, high: Array, top: int) -> npt.NDArray[Any]:
    """Return where samples lie between the extremes of their block."""
    reach = high - low
    scale = np.divide(top, reach, out=np.zeros_like(reach), where=reach > 0)
    with np.errstate(over="ignore", invalid="ignore"):
        levels = (rows - low[:, np.newaxis]) * scale[:, np.newaxis] + 0.5
    missing = np.isnan(levels)
    if missing.any():
        levels[missing] = top + 1
    return np.minimum(levels, top + 1, out=levels).astype(_kind(top))


def _kind(top: int) -> type[np.unsignedinteger[Any]]:
    return np.uint16 if top > _ONE_BYTE else np.uint8


def _differences(levels: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return levels less those before, as numbers without sign do."""
    flat = levels.ravel()
    return np.concatenate([flat[:1], flat[1:] - flat[:-1]])


def _bits(series: Series, top: int, merged: int) -> float:
    """Return the bits that a number takes, from some blocks."""
    width = BLOCK if merged == 1 else BLOCK // 2 * merged
    whole = series.values[: series.values.size // width * width].reshape(-1, width)
    if not whole.size:  # less than a block
        whole = np.full((1, width), np.nan)
        whole[0, : series.values.size] = series.values
    looked_at = np.array(whole[:: max(1, len(whole) // _LOOKED_AT)], np.float64)
    rows = looked_at if merged == 1 else _extremes(looked_at, merged).reshape(-1, BLOCK)
    levels = _found_levels(_without_huge(rows), top)[2]
    return min(_entropy(levels), _entropy(_differences(levels)))


def _found_levels(rows: Array, top: int) -> tuple[Array, Array, npt.NDArray[Any]]:
    low, high = np.min(rows, axis=1), np.max(rows, axis=1)
    if np.isnan(low).any():
        low, high = np.fmin.reduce(rows, axis=1), np.fmax.reduce(rows, axis=1)
    return low, high, _levels(rows, low, high, top)


def _entropy(levels: npt.NDArray[Any]) -> float:
    """Return bits a level, as a code of bytes takes them."""
    planes = levels.ravel().view(np.uint8).reshape(levels.size, -1)
    total = 0.0
    for plane in planes.T:
        share = np.bincount(plane, minlength=256) / plane.size
        share = share[share > 0]
        total -= float((share * np.log2(share)).sum())
    return total


def _packed(series: Series, top: int, merged: int) -> Packed:
    count = -(-series.values.size // BLOCK)
    kind = _kind(top)
    low, high, levels = np.empty(count), np.empty(count), np.empty(count * BLOCK, kind)
    for first in range(0, count, _CHUNK):
        last = min(count, first + _CHUNK)
        least, most, inside = _found_levels(_blocks(series, first, last), top)
        low[first:last], high[first:last] = least, most
        levels[first * BLOCK : last * BLOCK] = inside.ravel()
    # Single precision is enough for a distance from the middle, whatever the offset and the size.
    there = np.isfinite(low)
    bottom, ceiling = (float(low[there].min()), float(high[there].max())) if there.any() else (0.0, 0.0)
    middle, factor = bottom / 2 + ceiling / 2, (ceiling / 2 - bottom / 2) or 1.0
    extremes = (np.concatenate([low, high]) - middle) / factor
    some = levels.reshape(-1, BLOCK)[:: max(1, count // _LOOKED_AT)]
    by_difference = count > 0 and _entropy(_differences(some)) < _entropy(some)
    if by_difference:
        levels = _differences(levels)
    # Low bytes and high bytes apart: the high ones hardly change.
    planes = np.ascontiguousarray(levels.view(np.uint8).reshape(levels.size, -1).T)
    about = {
        "name": series.name,
        "unit": series.unit,
        "start": series.start,
        "period": series.period,
        "count": series.values.size,
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
