"""Calls under other modes of the processor: another rounding, denormal numbers as zero. Other programs in a process may set them."""

from __future__ import annotations

import ctypes
import mmap
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

import tvident
from calls import paper

Array = npt.NDArray[np.float64]

MODES = {"nearest": 0x1F80, "denormals as zero": 0x9FC0, "down": 0x3F80, "up": 0x5F80, "to zero": 0x7F80}
"""Values of the register of control and status, all exceptions masked."""

_LDMXCSR = bytes([0x0F, 0xAE, 0x17, 0xC3])
"""``ldmxcsr [rdi]; ret``."""

DIRECTED = 3e-5
"""How far numbers may be from those of rounding to nearest, relative to the largest.

Directed rounding doubles the error of an operation and lets errors add up, so that it grows with the number of operations n and not
with its root: n·2⁻⁵², for 3000 samples with up to 1000 operations each below 1e-9. Standard errors and choices by averages carry the
root of that, since squares of residuals are differences: below 3e-5.
"""


def available() -> bool:
    """Return whether the modes can be set here."""
    return platform.machine() == "x86_64" and platform.system() == "Linux"


@contextmanager
def mode(name: str) -> Iterator[None]:
    """Compute in a mode, and as usual again."""
    memory = mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
    memory.write(_LDMXCSR)
    address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    load = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address)
    value, usual = (ctypes.c_uint32(MODES[one]) for one in (name, "nearest"))
    load(ctypes.addressof(value))
    try:
        yield
    finally:
        load(ctypes.addressof(usual))


def works(generator: np.random.Generator) -> dict[str, Callable[[], Any]]:
    """Give calls of every function on one record, in the thread that calls."""
    n = int(generator.integers(2000, 3000))
    t = np.arange(n) / 1000
    angle = 0.2 * np.sin(12 * t) + 0.1 * np.sin(44 * t) + 1e-5 * generator.standard_normal(n)
    velocity = np.gradient(angle, t)
    torque = 0.01 * np.gradient(velocity, t) + 0.05 * velocity + 15 * angle + 1e-2 * generator.standard_normal(n)
    columns = np.stack([angle, t], axis=1)
    return {
        "weak form": lambda: tvident.identify(angle, torque, sample_rate=1000, workers=1).stiffness,
        "paper": lambda: tvident.identify(angle, torque, sample_rate=1000, workers=1, **paper()).stiffness,
        "derivatives": lambda: tvident.fit_local_polynomials(angle, 101, workers=1).derivatives[2],
        "errors": lambda: tvident.fit_local_polynomials(angle, 101, workers=1).stderr[2],
        "windows chosen": lambda: tvident.fit_local_polynomials(angle, "auto", workers=1).derivatives[1],
        "least squares": lambda: tvident.rolling_least_squares(columns, torque, 50, workers=1).params,
        "filter": lambda: tvident.savgol_filter(angle, 51, 3),
    }


def case(seed: int) -> None:
    """Compute in every mode: about the same numbers, the same ones missing, and the same bits as before afterwards."""
    calls = works(np.random.default_rng(seed))
    usual = {name: np.asarray(call()) for name, call in calls.items()}
    for one in list(MODES)[1:]:
        for name, call in calls.items():
            with mode(one):
                found = np.asarray(call())
            np.testing.assert_array_equal(np.isnan(found), np.isnan(usual[name]), err_msg=f"{name}, {one}")
            largest = float(np.nanmax(np.abs(usual[name])))
            far = float(np.nanmax(np.abs(found - usual[name]))) / largest
            assert far <= DIRECTED, f"{name}, {one}: {far:.1e} of the largest"
    for name, call in calls.items():
        assert np.asarray(call()).tobytes() == usual[name].tobytes(), f"{name}: other bits afterwards"
