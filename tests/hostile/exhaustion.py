"""Memory that runs out is a MemoryError, wherever it happens, and the next call works."""

from __future__ import annotations

import subprocess
import sys

import numpy as np

_PREPARED = """
import resource
import numpy as np, tvident
{records}
def size():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * resource.getpagesize()
x = np.sin(np.arange(500) / 20)
tvident.fit_local_polynomials(x, 51, workers=2)
resource.setrlimit(resource.RLIMIT_AS, (size() + {left}, resource.RLIM_INFINITY))
try:
    {call}
except MemoryError as error:
    assert str(error), "a message"
    print("MemoryError")
else:
    print("done")
resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
assert tvident.fit_local_polynomials(x, 51, workers=2).derivatives.shape == (3, 500)
print("usable")
"""

_OF_A_MILLION = """
t = np.arange(1_000_000) / 1000
y = 0.2 * np.sin(12 * t) + 0.1 * np.sin(44 * t) + 1e-5 * np.random.default_rng(0).standard_normal(t.size)
"""
_WITHOUT_MEMORY = (
    "y = np.broadcast_to(1.0, (10**12,))\nmany = np.broadcast_to(np.sin(np.arange(2000.0)), (10**9, 2000))\n"
)

CALLS = (
    (_WITHOUT_MEMORY, "tvident.fit_local_polynomials(y, 101)"),
    (_WITHOUT_MEMORY, "tvident.fit_local_polynomials(y, 101, quantisation=0)"),
    (_WITHOUT_MEMORY, "tvident.fit_local_polynomials(many, 101, quantisation=0)"),
    (_WITHOUT_MEMORY, "tvident.fit_local_polynomials(y, 'auto', quantisation=0)"),
    (_WITHOUT_MEMORY, "tvident.savgol_filter(y, 101, 3)"),
    (_WITHOUT_MEMORY, "tvident.savgol_filter(many, 101, 3, mode='wrap')"),
    (_WITHOUT_MEMORY, "tvident.rolling_least_squares(y, y, 101)"),
    (_WITHOUT_MEMORY, "tvident.identify(y, y, sample_rate=1000)"),
    (_WITHOUT_MEMORY, "tvident.identify(y, y, sample_rate=1000, method='paper')"),
    (_WITHOUT_MEMORY, "tvident.identify(many, many, sample_rate=1000, method='paper')"),
    (_OF_A_MILLION, "tvident.fit_local_polynomials(y, 201)"),
    (_OF_A_MILLION, "tvident.fit_local_polynomials(y, 'auto')"),
    (_OF_A_MILLION, "tvident.savgol_filter(y, 201, 3)"),
    (_OF_A_MILLION, "tvident.rolling_least_squares(y, 15 * y, 201)"),
    (_OF_A_MILLION, "tvident.identify(y, 15 * y, sample_rate=1000)"),
    (_OF_A_MILLION, "tvident.identify(y, 15 * y, sample_rate=1000, method='paper')"),
)

_MEBIBYTE = 1 << 20

_LONGEST = 40
"""Seconds after which a call hangs."""


def case(seed: int) -> None:
    """Make one call with little memory left."""
    generator = np.random.default_rng(seed)
    records, call = CALLS[seed % len(CALLS)]
    left = int(generator.choice([1, 4, 16, 40, 100, 200])) * _MEBIBYTE
    program = _PREPARED.format(records=records, left=left, call=call)
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_LONGEST)
    said = f"{call} with {left // _MEBIBYTE} MiB left ended with {done.returncode}: {done.stderr[-1500:]}"
    assert done.returncode == 0, said
    assert done.stdout.endswith("usable\n"), said
