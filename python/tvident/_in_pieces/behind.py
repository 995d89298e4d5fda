"""Keeps what was found of one piece while the next one is worked on."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Self


class Behind:
    """One thread that does one thing after the other, never more than one behind who asks for them.

    Used as a context manager: at its end all is done that was asked for, also after an error or an interruption.

    Parameters
    ----------
    is_apart : bool
        False does everything at once, in the thread that asks.
    """

    def __init__(self, *, is_apart: bool) -> None:
        self._pool = ThreadPoolExecutor(1, "tvident-keeps") if is_apart else None
        self._last: Future[object] | None = None

    def do(self, work: Callable[[], object]) -> None:
        """Ask for something, when what was asked for before is done.

        Raises
        ------
        Exception
            What that raised.
        """
        self.finish()
        if self._pool is None:
            work()
        else:
            self._last = self._pool.submit(work)

    def finish(self) -> None:
        """Wait until all is done, and raise what that raised."""
        last, self._last = self._last, None
        if last is not None:
            last.result()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._pool is not None:
            self._pool.shutdown()
        if error is None:
            self.finish()
