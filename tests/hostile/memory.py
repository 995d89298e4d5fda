"""Memory that runs out anywhere in a call is a MemoryError, and the next call finds all of it again."""

from __future__ import annotations

import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import tvident
from calls import paper

Array = npt.NDArray[np.float64]

_MIB = 1 << 20


def works(angle: Array, torque: Array, workers: int) -> list[Callable[[], object]]:
    """Give calls of every function that works on whole records."""
    holed = torque.copy()
    holed[len(holed) // 2] = np.nan
    window = len(angle) // 4 * 2 + 1
    rate: dict[str, Any] = {"sample_rate": 1000.0, "workers": workers}
    return [
        lambda: tvident.fit_local_polynomials(angle, 201, workers=workers),
        lambda: tvident.fit_local_polynomials(angle, window, workers=workers).stderr,
        lambda: tvident.fit_local_polynomials(angle, 201, selection="pooled", workers=workers).stderr,
        lambda: tvident.fit_local_polynomials(angle, "auto", workers=workers),
        lambda: tvident.fit_local_polynomials(angle.reshape(-1, 100), 51, workers=workers),
        lambda: tvident.savgol_filter(angle, 201, 3),
        lambda: tvident.rolling_least_squares(angle, torque, 201, workers=workers),
        lambda: tvident.rolling_least_squares(angle, torque, window, workers=workers),
        lambda: tvident.identify(angle, torque, **rate),
        lambda: tvident.identify(angle, torque, stiffness="windowed", inertia="windowed", **rate),
        lambda: tvident.identify(angle, torque, **rate, **paper()),
        lambda: tvident.identify(angle, holed, **rate, **paper()),
        lambda: tvident.identify(
            angle, torque, **rate, **paper(stiffness="constant", damping="constant", inertia="constant")
        ),
    ]


def _now() -> int:
    """Bytes of the process's address space."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(next(line for line in status.splitlines() if line.startswith("VmSize:")).split()[1]) << 10


def case(seed: int) -> None:
    """Make one call with less and less memory."""
    generator = np.random.default_rng(seed)
    n = 100 * int(10 ** generator.uniform(1, 3.7))
    t = np.arange(n) / 1000
    angle = 0.2 * np.sin(12 * t) + 0.1 * np.sin(44 * t) + 1e-4 * generator.standard_normal(n)
    torque = np.asarray(15 * angle + 0.01 * np.gradient(np.gradient(angle, t), t) + 0.01 * generator.standard_normal(n))
    calls = works(angle, torque, int(generator.integers(1, 4)))
    work = calls[seed % len(calls)]
    # Rooms are entered when they are asked for, and their libraries need memory of their own.
    for name in tvident.__all__:
        getattr(tvident, name)
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    # A record of a few hundred bytes a sample is the most that any call needs.
    most = 100 * _MIB + 300 * n
    for room in [0, *sorted(generator.integers(0, most, 6).tolist(), reverse=True)]:
        resource.setrlimit(resource.RLIMIT_AS, (_now() + room, hard))
        try:
            work()
        except MemoryError:
            pass
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
    work()
