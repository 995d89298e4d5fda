"""Results that are kept, and work that is done in parallel where they are missing."""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

Values = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """Work that yields a result for every one of its keys."""

    keys: tuple[str, ...]
    function: Callable[..., Sequence[Values]]
    arguments: tuple[Any, ...]

    def __call__(self) -> Sequence[Values]:
        """Return the results in the order of the keys."""
        return self.function(*self.arguments)


class Store:
    """Results by key, in a file of one line each that is only ever appended to: a run that is cut off loses nothing."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._results: dict[str, Values] = {}
        self._cut_off = False
        if path.exists():
            text = path.read_text(encoding="utf-8")
            self._cut_off = not text.endswith("\n")
            for line in text.splitlines():
                try:
                    key, values = json.loads(line)
                except ValueError:
                    # The line that a run was cut off in.
                    continue
                self._results[key] = values

    def __contains__(self, key: str) -> bool:
        return key in self._results

    def get(self, key: str) -> Values | None:
        """Return a result, where there is one."""
        return self._results.get(key)

    def put(self, results: Iterable[tuple[str, Values]]) -> None:
        """Keep results."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8") as file:
            if self._cut_off:
                file.write("\n")
                self._cut_off = False
            for key, values in results:
                self._results[key] = values
                file.write(json.dumps([key, values], default=str) + "\n")

    def complete(self, jobs: Sequence[Job], workers: int, description: str) -> None:
        """Do jobs in as many processes, in this one where `workers` is 0, keeping every result as it comes."""
        with tqdm(total=len(jobs), desc=description, disable=None, smoothing=0.05) as bar:
            if workers == 0:
                for job in jobs:
                    self.put(zip(job.keys, job(), strict=True))
                    bar.update()
                return
            # Every process is one thread: libraries must not start more of their own.
            os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
            with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
                running = {pool.submit(job): job for job in jobs}
                try:
                    for done in as_completed(running):
                        self.put(zip(running[done].keys, done.result(), strict=True))
                        bar.update()
                except BaseException:
                    pool.shutdown(wait=False, cancel_futures=True)
                    raise


def key(**parts: Any) -> str:
    """Return a key made of named parts."""
    return json.dumps(parts, sort_keys=True)
