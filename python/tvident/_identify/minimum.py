"""The minimum of a function of one variable with several valleys, of many records side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

GRID = 17
"""Places that are tried first, evenly from end to end."""

_VALLEYS = 3
"""Valleys of the grid that are looked into: the deepest place tried need not lie in the deepest valley."""

_SECTIONS = 8
"""Golden sections of a valley at most: two grid spacings become a 23rd of one."""

_FLAT = 0.02
"""Differences of the criterion that do not matter: a likelihood one per cent better."""

_GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class Minimum:
    """Where functions of places from 0 to 1 are lowest.

    Parameters
    ----------
    place, score : ndarray, shape (records,)
        The best place that was tried, and the criterion there.
    """

    place: Array
    score: Array


def lowest(criterion: Callable[[Array], Array], records: int) -> Minimum:
    """Return the minimum over places from 0 to 1: on a grid, in its deepest valleys, then by golden sections of the best.

    Parameters
    ----------
    criterion : callable
        Function of a place for every record, shape (records,), that returns as many values; infinite where there is none.
    records : int
    """
    grid = np.linspace(0, 1, GRID)
    scores = np.stack([criterion(np.full(records, place)) for place in grid])
    every = np.arange(records)
    guesses = np.stack([_valleys(column) for column in scores.T], axis=1)
    deep = np.stack([criterion(guess) for guess in guesses])
    best = deep.argmin(axis=0)
    place, score = guesses[best, every], deep[best, every]
    on_grid = scores.argmin(axis=0)
    better = scores[on_grid, every] <= score
    place, score = np.where(better, grid[on_grid], place), np.where(better, scores[on_grid, every], score)
    spacing = grid[1]
    return _golden(criterion, Minimum(place, score), np.clip(place - spacing, 0, 1), np.clip(place + spacing, 0, 1))


def _valleys(scores: Array) -> Array:
    """Return where the deepest valleys of scores on the grid are likely to be lowest, by parabolas through three places."""
    padded = np.concatenate(([np.inf], np.where(np.isfinite(scores), scores, np.inf), [np.inf]))
    found: list[tuple[float, float]] = []
    for at in range(1, GRID + 1):
        before, here, after = padded[at - 1 : at + 2]
        if not np.isfinite(here) or here > before or here > after:
            continue
        bend = before - 2 * here + after
        shift = 0.5 * (before - after) / bend if np.isfinite(bend) and bend > 0 else 0.0
        depth = here - 0.25 * (before - after) * shift if shift else here
        found.append((depth, (at - 1 + shift) / (GRID - 1)))
    places = [place for _, place in sorted(found)[:_VALLEYS]] or [0.5]
    return np.array([*places, *[places[0]] * (_VALLEYS - len(places))])


def _golden(criterion: Callable[[Array], Array], best: Minimum, low: Array, high: Array) -> Minimum:
    """Return the minimum between `low` and `high`, where the best so far lies."""
    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    scores = [criterion(inner[0]), criterion(inner[1])]
    place, score = best.place, best.score
    done = np.zeros(place.size, bool)
    for section in range(_SECTIONS + 1):
        for tried, found in zip(inner, scores, strict=True):
            # A record that is done stays what it would be alone.
            better = ~done & (found < score)
            place, score = np.where(better, tried, place), np.where(better, found, score)
        with np.errstate(invalid="ignore"):
            done |= (np.abs(scores[0] - scores[1]) < _FLAT) & (np.abs(inner[1] - inner[0]) < 1 / (GRID - 1) / _SECTIONS)
        if done.all() or section == _SECTIONS:
            break
        left = scores[0] <= scores[1]
        low, high = np.where(left, low, inner[0]), np.where(left, inner[1], high)
        new = np.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        kept, kept_score = np.where(left, inner[0], inner[1]), np.where(left, scores[0], scores[1])
        found = criterion(np.where(done, place, new))
        inner = [np.where(left, new, kept), np.where(left, kept, new)]
        scores = [np.where(left, found, kept_score), np.where(left, kept_score, found)]
    return Minimum(place, score)
