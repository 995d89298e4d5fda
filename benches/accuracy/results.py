"""Errors of methods on recordings of cases: computed, kept, and put together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from accuracy.cases import Case
from accuracy.methods import METHODS
from accuracy.store import Job, Store, key

Values = dict[str, Any]


def _evaluate(case: Case, number: int, names: tuple[str, ...]) -> list[Values]:
    """Simulate a recording and run methods on it."""
    recording = case.record(number)
    return [METHODS[name].timed(case, recording) for name in names]


@dataclass(frozen=True)
class Results:
    """What methods said of the first recordings of cases, as far as it is known."""

    store: Store
    recordings: int

    def _key(self, case: Case, number: int, name: str) -> str:
        return key(case=case.key(), recording=number, method=name, of=METHODS[name].fingerprint())

    def compute(self, cases: Iterable[Case], names: Sequence[str], workers: int, description: str) -> None:
        """Compute what is missing, as far as the packages are installed."""
        jobs = []
        for case in cases:
            for number in range(self.recordings):
                wanted = [
                    name
                    for name in names
                    if METHODS[name].installed and number < (METHODS[name].most or self.recordings)
                ]
                keys = {name: self._key(case, number, name) for name in wanted}
                missing = tuple(name for name in wanted if keys[name] not in self.store)
                if missing:
                    jobs.append(Job(tuple(keys[name] for name in missing), _evaluate, (case, number, missing)))
        self.store.complete(jobs, workers, description)

    def of(self, case: Case, name: str) -> list[Values]:
        """Return what a method said of each recording."""
        if not METHODS[name].installed:
            return []
        stored = (self.store.get(self._key(case, number, name)) for number in range(self.recordings))
        return [values for values in stored if values is not None]

    def available(self, case: Case, name: str) -> list[Values]:
        """Return what a method said, if it was not refused."""
        return [values for values in self.of(case, name) if values and "unavailable" not in values]

    def both(self, case: Case, one: str, other: str) -> list[tuple[Values, Values]]:
        """Return what two methods said of the same recordings, where neither was refused."""
        found = []
        for number in range(self.recordings):
            pair = [self.store.get(self._key(case, number, name)) for name in (one, other)]
            if all(values is not None and "unavailable" not in values for values in pair):
                found.append((pair[0] or {}, pair[1] or {}))
        return found

    def median(self, case: Case, name: str, quantity: str) -> float:
        """Return the median over recordings; NaN where nothing is known."""
        found = [float(values[quantity]) for values in self.available(case, name) if quantity in values]
        return float(np.median(found)) if found else float("nan")

    def refusals(self, cases: Iterable[Case], names: Iterable[str]) -> dict[str, str]:
        """Return why there are no results of methods, or not of all recordings, by name."""
        said: dict[str, str] = {}
        listed = list(cases)
        for name in names:
            if not METHODS[name].installed:
                said[name] = f"needs {', '.join(METHODS[name].packages)}"
                continue
            found = [values for case in listed for values in self.of(case, name)]
            if not found:
                said[name] = "not run"
            reasons = [str(values["unavailable"]) for values in found if "unavailable" in values]
            if reasons:
                said[name] = reasons[-1]
        return said
