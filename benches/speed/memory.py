"""What the process does with memory that is given back."""

from __future__ import annotations

import ctypes

# Of malloc.h.
_TRIM_THRESHOLD = -1
_MMAP_MAX = -4


def keep_freed_memory() -> bool:
    """Let the process keep what is given back, so that a warmed process finds its pages warm; return whether that could be done.

    Otherwise every result above 32 MB is fresh memory from the system, and a measurement is one of the system: on a virtual machine
    whose host takes free pages back, their first touch was seen to cost anything from 7 to 200 ns a sample of `identify`.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return False
    return bool(mallopt(_MMAP_MAX, 0) and mallopt(_TRIM_THRESHOLD, -1))
