"""Hears Ctrl-C wherever it arrives."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_IMPORT = "<frozen importlib._bootstrap>"
"""What Python calls the file of its own that imports."""

_LONGEST = 0.5
"""Seconds that an interrupt waits for the end of an import: the first of matplotlib looks at all fonts of the system."""


@contextmanager
def every_interrupt_heard() -> Iterator[None]:
    """Raise an interrupt once more where Python could not raise it, and after an import that it arrives in.

    Nothing can be raised from what runs when an object goes, and every import ends with such work: Python writes a line about the
    interrupt, forgets it, and the command goes on. A module that Cython made takes back what is raised while it begins.
    """
    usual, thread = sys.unraisablehook, _thread.get_ident()
    outer, raise_now = _imports(sys._getframe()), signal.getsignal(signal.SIGINT)  # noqa: SLF001 - the way to the own frame
    asked = 0.0
    is_ours = callable(raise_now) and threading.current_thread() is threading.main_thread()

    def hear(lost: sys.UnraisableHookArgs) -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            _thread.start_new_thread(_interrupt_soon, (thread,))
        else:
            usual(lost)

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        asked = asked or time.monotonic()
        if _imports(frame) > outer and time.monotonic() - asked < _LONGEST:
            _thread.start_new_thread(_interrupt_soon, (thread,))
        elif callable(raise_now):
            asked = 0.0
            raise_now(number, frame)

    sys.unraisablehook = hear
    if is_ours:
        signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        sys.unraisablehook = usual
        if is_ours:
            signal.signal(signal.SIGINT, raise_now)


def _imports(frame: FrameType | None) -> int:
    """Return how many calls that are going on belong to imports."""
    count = 0
    while frame is not None:
        count += frame.f_code.co_filename == _IMPORT
        frame = frame.f_back
    return count


def _interrupt_soon(thread: int) -> None:
    """Interrupt a thread when it has left what cannot raise, and wake it where it waits."""
    time.sleep(0.01)
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(thread, signal.SIGINT)
    else:
        _thread.interrupt_main()
