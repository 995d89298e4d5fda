"""Hears Ctrl-C wherever it arrives."""

from __future__ import annotations

import _thread
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def every_interrupt_heard() -> Iterator[None]:
    """Raise an interrupt once more where Python could not raise it.

    Nothing can be raised from what runs when an object goes, and every import ends with such work: Python writes a line about the
    interrupt, forgets it, and the command goes on.
    """
    usual, thread = sys.unraisablehook, _thread.get_ident()

    def hear(lost: sys.UnraisableHookArgs) -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            _thread.start_new_thread(_interrupt_soon, (thread,))
        else:
            usual(lost)

    sys.unraisablehook = hear
    try:
        yield
    finally:
        sys.unraisablehook = usual


def _interrupt_soon(thread: int) -> None:
    """Interrupt a thread when it has left what cannot raise, and wake it where it waits."""
    time.sleep(0.01)
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(thread, signal.SIGINT)
    else:
        _thread.interrupt_main()
