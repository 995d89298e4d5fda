"""Progress bars for long work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

from tvident._arguments.shown import shown

Progress: TypeAlias = bool | Callable[[int, int], object] | None
"""``True`` shows a bar; a callable is given the work done and all of it."""


class ForwardProgress:
    """What is told of work of several stages, some of which begin anew: never less than before, and the whole at the end alone, once.

    Parameters
    ----------
    report : callable
        Takes the work done and all of it.
    """

    def __init__(self, report: Callable[[int, int], object]) -> None:
        self._report = report
        self._told = (0, 0)

    def __call__(self, done: int, total: int) -> object:
        """Tell the work done, or what was told before where that was a larger part of its whole; nothing once the whole was told."""
        if self._told[0] == self._told[1] > 0:
            return None
        done = max(0, min(done, total - 1))
        if total > 0 and done * self._told[1] >= self._told[0] * total:
            self._told = (done, total)
        return self._report(*self._told)

    def finish(self) -> None:
        """Tell that all is done, unless nothing was told, or that already."""
        done, total = self._told
        if done < total:
            self._told = (total, total)
            self._report(total, total)


class WatchedProgress:
    """What is told of the work done, and the error that it raised, which is none of the work."""

    def __init__(self, report: ForwardProgress) -> None:
        self._report = report
        self.error: BaseException | None = None

    def __call__(self, done: int, total: int) -> object:
        """Tell, and keep what is raised."""
        with self._watched():
            return self._report(done, total)

    def finish(self) -> None:
        """Tell that all is done, likewise."""
        with self._watched():
            self._report.finish()

    @contextmanager
    def _watched(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            self.error = error
            raise


@contextmanager
def reporter(progress: Progress, description: str) -> Iterator[ForwardProgress | None]:
    """Give what stages of the work call with the work done and all of it, in any order: a bar, the user's own callable, or nothing."""
    with _told(progress, description) as report:
        forward = None if report is None else ForwardProgress(report)
        yield forward
        if forward is not None:
            forward.finish()


@contextmanager
def _told(progress: Progress, description: str) -> Iterator[Callable[[int, int], object] | None]:
    """Give what takes the work done and all of it, in order."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        try:
            from tqdm.auto import tqdm  # noqa: PLC0415 - optional
        except ImportError:
            raise ImportError(
                "progress=True needs tqdm, which is not installed; install it with: pip install 'tvident[cli]', "
                "or pass a function of (done, total)"
            ) from None

        with tqdm(desc=description, unit="sample", unit_scale=True) as bar:

            def update(done: int, total: int) -> None:
                bar.total = total
                bar.update(done - bar.n)

            yield update
    elif callable(progress):
        yield progress
    else:
        raise TypeError(
            f"progress must be True, False or a function of (done, total); got {shown(progress)}; pass one of these"
        )
