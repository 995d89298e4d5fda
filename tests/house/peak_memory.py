"""Run one call in a process of its own and print by how many bytes it raised the most memory the process ever held.

Called by ``test_memory.py`` with the name of the call, the samples, the window and the threads. Linux alone keeps such a record.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import tvident

Array = npt.NDArray[np.float64]

STEP = 1000
"""Results of every so manieth sample are next to nothing: what is left is scratch."""

WINDOWED: dict[str, Any] = {
    **dict.fromkeys(("inertia", "damping", "stiffness"), "windowed"),
    "terms": (),
    "sample_rate": 1000,
    "step": STEP,
}

CALLS: dict[str, Callable[[Array, Array, int, int], object]] = {
    "the paper's method": lambda angle, torque, _window, workers: tvident.identify(
        angle, torque, sample_rate=1000, method="paper", workers=workers
    ),
    "the automatic method": lambda angle, torque, _window, workers: tvident.identify(
        angle, torque, sample_rate=1000, workers=workers
    ),
    "fit_local_polynomials": lambda angle, _torque, window, workers: tvident.fit_local_polynomials(
        angle, window | 1, step=STEP, workers=workers
    ),
    "rolling_least_squares": lambda angle, torque, window, workers: tvident.rolling_least_squares(
        np.lib.stride_tricks.sliding_window_view(angle, 3), torque[:-2], window, step=STEP, workers=workers
    ),
    "identify, window": lambda angle, torque, window, workers: tvident.identify(
        angle, torque, **WINDOWED, method=tvident.StrongForm(window_length=window | 1), workers=workers
    ),
    "identify, regression window": lambda angle, torque, window, workers: tvident.identify(
        angle, torque, **WINDOWED, method=tvident.StrongForm(regression_window=window), workers=workers
    ),
}


def held(field: str) -> int:
    """Return bytes that the kernel says this process holds (VmRSS), or ever held since the record was cleared (VmHWM)."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(field):
            return int(line.split()[1]) * 1024
    raise LookupError(field)


def main(name: str, samples: int, window: int, workers: int) -> int:
    """Return by how many bytes the call raised the peak."""
    generator = np.random.default_rng(0)
    t = np.arange(samples) / 1000
    angle = np.sin(20 * t) + 0.3 * np.sin(7 * t) + 1e-3 * generator.standard_normal(samples)
    torque = 15 * angle + 0.1 * generator.standard_normal(samples)
    del t
    call = CALLS[name]
    call(angle[:1000], torque[:1000], 51, workers)  # loads the code and starts the threads
    # What earlier work gave back must not serve the call unseen.
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before = held("VmRSS")
    result = call(angle, torque, window, workers)
    risen = held("VmHWM") - before
    del result  # kept until here
    return risen


if __name__ == "__main__":
    print(main(sys.argv[1], *(int(argument) for argument in sys.argv[2:])))  # noqa: T201 - for the test that called
