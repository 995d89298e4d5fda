"""Calls from many threads at once, and from a fork in their midst, give what a call alone gives."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import tvident
from calls import paper

Array = npt.NDArray[np.float64]

_LONGEST_CHILD = 25
"""Seconds after which a fork hangs."""


def works(generator: np.random.Generator) -> list[Callable[[int], bytes]]:
    """Give calls of every function on one record, each a function of the number of workers."""
    n = int(generator.integers(700, 3000))
    t = np.arange(n) / 1000
    angle = 0.2 * np.sin(12 * t) + 0.1 * np.sin(44 * t) + 1e-4 * generator.standard_normal(n)
    torque = np.asarray(15 * angle + 0.01 * np.gradient(np.gradient(angle, t), t) + 0.01 * generator.standard_normal(n))
    columns = np.stack([angle, t], axis=1)
    return [
        lambda w: tvident.identify(angle, torque, sample_rate=1000, workers=w).stiffness.tobytes(),
        lambda w: tvident.identify(angle, torque, sample_rate=1000, workers=w, **paper()).stiffness.tobytes(),
        lambda w: tvident.fit_local_polynomials(angle, 101, workers=w).derivatives.tobytes(),
        lambda w: tvident.rolling_least_squares(columns, torque, 50, workers=w).params.tobytes(),
        lambda _: tvident.savgol_filter(angle, 51, 3).tobytes(),
    ]


def case(seed: int) -> None:
    """Call from threads, and fork while they work."""
    generator = np.random.default_rng(seed)
    calls = works(generator)
    alone = [call(1) for call in calls]
    differing: list[int] = []

    def work(place: int) -> None:
        for turn in range(2):
            which = (place + turn) % len(calls)
            if calls[which](1 + (place * 7 + turn) % 64) != alone[which]:
                differing.append(which)

    threads = [threading.Thread(target=work, args=(place,)) for place in range(int(generator.integers(2, 17)))]
    for thread in threads:
        thread.start()
    which = int(generator.integers(len(calls)))
    child = os.fork()
    if not child:
        signal.alarm(_LONGEST_CHILD)
        os._exit(0 if calls[which](2) == alone[which] else 1)
    for thread in threads:
        thread.join()
    ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert not differing
    assert ended == 0, "a fork in the midst of work gives the same numbers"
