"""Rows below the samples that hold their statistics without a word: means, deviations, extremes, sums, counts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from tvident._files.channels import Say

_MOST = 8
"""Rows of statistics."""

_FEWEST_SAMPLES = 20
"""Above them: of fewer a sample may be what it seems."""

_BY_CHANCE = 1e-3
"""Probability that a sample is as near to a statistic in all columns as the last row is."""

_TELLING = frozenset({"mean", "standard deviation"})
"""Of which the rows below hold one."""

_WITHOUT_TIMES = 2
"""Rows, each another statistic, that tell themselves: one alone may be the sample with which a motion ends at its mean."""

_MOST_DIGITS = 17


def without_statistics(columns: npt.NDArray[np.float64], say: Say) -> npt.NDArray[np.float64]:
    """Return columns, shape (columns, samples), without the last rows where each holds one statistic of all rows above, which is said.

    Behind times only where these go on up to there and no further; without times only where several rows hold a statistic each, for a
    last sample may be near the mean of all.
    """
    samples = columns.shape[1]
    if samples <= _FEWEST_SAMPLES or not _may_hold(columns):
        return columns
    for rows in range(min(_MOST, samples - _FEWEST_SAMPLES), 0, -1):
        ends = _times_end(columns, rows)
        if not ends and (rows < _WITHOUT_TIMES or _has_times(columns[:, :-rows])):
            continue
        above, names = columns[:, :-rows], []
        for place in range(samples - rows, samples):
            names.append(_statistic(above, columns[:, place]))
            if not names[-1]:
                break
        is_told = ends or len(set(names)) == rows
        # The greatest of all rows may be the last sample of a ramp.
        if names[-1] and is_told and _TELLING.intersection(names):
            said = "the last row holds" if rows == 1 else f"the last {rows} rows hold"
            say(f"{said} the {', '.join(names)} of the rows above: not read, as no samples")
            return above
    return columns


def _times_end(columns: npt.NDArray[np.float64], rows: int) -> bool:
    """Return whether a column increases up to the last rows, as times do, and not from there to the first of them."""
    above, first = columns[:, :-rows], columns[:, -rows]
    is_clock = np.array([bool((np.diff(column) > 0).all()) for column in above])
    return bool((is_clock & ~(first > above[:, -1])).any())


def _has_times(columns: npt.NDArray[np.float64]) -> bool:
    return any(bool((np.diff(column) > 0).all()) for column in columns)


def _may_hold(columns: npt.NDArray[np.float64]) -> bool:
    """Return whether a column holds its mean or deviation among its last numbers, about: of most texts one column tells that none does."""
    count = min(_MOST, columns.shape[1] - _FEWEST_SAMPLES)
    for column in columns:
        values, last = column[:-count], column[-count:]
        if not np.isfinite(last[-1]):
            continue
        values = values[np.isfinite(values)]
        if not values.size:
            continue
        # Of so many more rows.
        near = 2 * count / values.size * float(np.ptp(values))
        middle = (float(values.mean()), float(values.std()))
        within = near + np.array([half_digit(one) for one in last.tolist()])
        if not any((np.abs(last - one) <= within).any() for one in middle):
            return False
    return True


def _statistic(above: npt.NDArray[np.float64], row: npt.NDArray[np.float64]) -> str:
    """Return which statistic of the rows above a row holds; nothing where it holds none, or may by chance."""
    places = np.flatnonzero(np.isfinite(row))
    if not places.size:
        return ""
    first = above[places[0]]
    # One column excludes nearly all rows that are samples, before others are summed.
    for name, value, error in _statistics(first[np.isfinite(first)]):
        if abs(row[places[0]] - value) <= error + half_digit(row[places[0]]) and _is_of_all(above, row, places, name):
            return name
    return ""


def _is_of_all(
    above: npt.NDArray[np.float64], row: npt.NDArray[np.float64], places: npt.NDArray[np.intp], name: str
) -> bool:
    chance = 1.0
    for place in places:
        values = above[place][np.isfinite(above[place])]
        within = [
            error + half_digit(row[place])
            for called, value, error in _statistics(values)
            if called == name and abs(row[place] - value) <= error + half_digit(row[place])
        ]
        if not within:
            return False
        chance *= (1 + np.count_nonzero(np.abs(values - row[place]) <= within[0])) / (1 + values.size)
    return chance < _BY_CHANCE


def _statistics(values: npt.NDArray[np.float64]) -> Iterator[tuple[str, float, float]]:
    """Give the statistics of numbers: their names, themselves, and how far they are off since numbers were rounded when written."""
    if not values.size:
        return
    count, half = values.size, max(map(half_digit, values[:_MOST].tolist()))
    # Rounded numbers are off by a third of half a digit's square on average, in either direction.
    mean, of_mean = float(values.mean()), 4 * half / np.sqrt(3 * count)
    rounding = 8 * np.finfo(np.float64).eps * float(np.abs(values).max())
    yield "mean", mean, of_mean + rounding
    yield "least", float(values.min()), rounding
    yield "greatest", float(values.max()), rounding
    for freedom in (0, 1):
        yield "standard deviation", float(values.std(ddof=freedom)), half / np.sqrt(count) + rounding
    yield "root of the mean square", float(np.sqrt(np.mean(values**2))), half / np.sqrt(count) + rounding
    yield "sum", mean * count, (of_mean + rounding) * count
    yield "count", float(count), 0.0
    yield "median", float(np.median(values)), half + rounding


def half_digit(value: float) -> float:
    """Return half of the last decimal digit that a number was written with, as far as the number tells."""
    digits = next((digits for digits in range(_MOST_DIGITS) if round(value, digits) == value), _MOST_DIGITS)
    return 0.5 * 10.0**-digits
