"""Progress bars for long work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

from tvident._arguments.shown import shown

Progress: TypeAlias = bool | Callable[[int, int], object] | None
"""``True`` shows a bar; a callable is given the work done and all of it."""


class WatchedProgress:
    """What is told of the work done, and the error that it raised, which is none of the work."""

    def __init__(self, report: Callable[[int, int], object]) -> None:
        self._report = report
        self.error: BaseException | None = None

    def __call__(self, done: int, total: int) -> object:
        """Tell, and keep what is raised."""
        try:
            return self._report(done, total)
        except BaseException as error:
            self.error = error
            raise


@contextmanager
def reporter(progress: Progress, description: str) -> Iterator[Callable[[int, int], object] | None]:
    """Give what the core calls with the work done and all of it: a bar, the user's own callable, or nothing."""
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
