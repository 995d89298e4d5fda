"""How much of a channel few lines of a spectrum leave unexplained, where samples lie anywhere."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]

_LINES = 12
"""Frequencies, of which a periodic motion has that many harmonics at most."""

_SAMPLES, _PLACES = 1 << 12, 1 << 16
"""Samples that are looked at, at most, and places that they may lie apart."""

_STEPS = 2
"""Steps of all frequencies towards those that leave least, after each that is added."""


@np.errstate(all="ignore")
def left_by_lines(places: Numbers, values: Numbers) -> float:
    """Return the part of the squares that few lines leave, each where the rest has most power; NaN where nothing is there.

    Parameters
    ----------
    places : ndarray, shape (n,)
        Increasing, in usual steps.
    values : ndarray, shape (n,)
    """
    is_there = np.isfinite(values)
    places, values = places[is_there] - places[0], values[is_there]
    some = places < _PLACES
    places, values = places[some][:_SAMPLES], values[some][:_SAMPLES]
    rest = values = values - values.mean() if values.size else values
    energy = float(values @ values)
    if values.size <= 4 * _LINES or not energy > 0:
        return float("nan")
    grid = np.zeros(int(places[-1]) + 2)
    frequencies = np.empty(0)
    for _ in range(_LINES):
        grid[:] = 0.0
        grid[np.rint(places).astype(np.intp)] = rest
        power = np.abs(np.fft.rfft(grid, 2 * grid.size))
        frequencies = np.append(frequencies, float(np.argmax(power[1:]) + 1) / (2 * grid.size))
        for _ in range(_STEPS):
            frequencies, rest = _stepped(places, values, frequencies)
        if not np.isfinite(frequencies).all():
            return float("nan")
    return float(rest @ rest) / energy


def _stepped(places: Numbers, values: Numbers, frequencies: Numbers) -> tuple[Numbers, Numbers]:
    """Return frequencies after a step towards least squares, and what the lines before it leave."""
    phases = 2 * np.pi * np.outer(places, frequencies)
    cosines, sines = np.cos(phases), np.sin(phases)
    columns = np.hstack([np.ones((places.size, 1)), cosines, sines])
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    rest = values - columns @ found
    count = frequencies.size
    slopes = 2 * np.pi * places[:, np.newaxis] * (found[1 + count :] * cosines - found[1 : 1 + count] * sines)
    step = np.linalg.lstsq(np.hstack([columns, slopes]), rest, rcond=None)[0][1 + 2 * count :]
    # A line that is hardly there may go anywhere.
    most = 0.5 / places[-1]
    return np.clip(frequencies + np.clip(step, -most, most), 0.1 * most, 0.5), rest
