"""Wall time of several works, measured in turns so that whatever else the machine does falls on all of them."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Work = Callable[[], object]


@dataclass(frozen=True)
class Effort:
    """How long to measure a row."""

    seconds: float
    """No further round is begun after this."""
    least: int
    """Rounds that are measured however long they take."""
    most: int = 101
    """Rounds that are enough."""


@dataclass(frozen=True)
class Timings:
    """Seconds that one call of every work took: one row a round, one column a work."""

    wall: npt.NDArray[np.float64]
    """What passed on the clock."""
    processor: npt.NDArray[np.float64]
    """What all threads of this process worked: blind to other processes that wait for the same processors."""


def alternate(works: list[Work], effort: Effort, calls: int = 1) -> Timings:
    """Time works one after the other, round after round, every second round backwards.

    Each is called once beforehand. A measurement covers so many calls and the allocation of their results; these are given back
    after the clock has stopped.
    """
    for work in works:
        work()
    rounds: list[list[tuple[float, float]]] = []
    collecting = gc.isenabled()
    gc.disable()
    try:
        started = time.perf_counter()
        while len(rounds) < effort.most:
            if len(rounds) >= effort.least and time.perf_counter() - started > effort.seconds:
                break
            turn = [(0.0, 0.0)] * len(works)
            places = range(len(works)) if len(rounds) % 2 == 0 else reversed(range(len(works)))
            for place in places:
                turn[place] = _clock(works[place], calls)
            rounds.append(turn)
    finally:
        if collecting:
            gc.enable()
    wall, processor = np.moveaxis(np.array(rounds), -1, 0)
    return Timings(wall, processor)


def _clock(work: Work, calls: int) -> tuple[float, float]:
    """Return what one call took on the clock and of the processor."""
    worked, began = time.process_time(), time.perf_counter()
    for _ in range(calls - 1):
        work()
    result = work()
    ended, rested = time.perf_counter(), time.process_time()
    del result
    return (ended - began) / calls, (rested - worked) / calls
