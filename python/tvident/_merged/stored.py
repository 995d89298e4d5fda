"""Results of trials and masses in files."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._files import write_result
from tvident._merged.elements import Element
from tvident._results import plain_curves, plain_scan, plain_words

Array: TypeAlias = npt.NDArray[np.float64]

KIND = "merged"
OWN = "own"
"""Stands for the variance of an element, which its standard error gives."""

FORMAT = 1
"""Files of another number hold other things."""


def store(path: Path, result: Any) -> None:
    """Write a result: its columns, what else has one value a sample, and the rest as JSON."""
    merging = result._merging  # noqa: SLF001 - of this room
    arrays = result.columns()
    between: list[list[Any]] = []
    # Sums over them have the same bits only in the same order.
    for (one, other), values in result._covariances.items():  # noqa: SLF001 - of this room
        alike = values.strides == (0,) and values.size > 0
        between.append([one, other, OWN if one == other else float(values[0]) if alike else None])
        if between[-1][2] is None:
            arrays[f"covariance {len(between)}"] = values
    for name, pattern in merging.inertia.items():
        for (row, column), values in entries_of(result._wanted(pattern)):  # noqa: SLF001 - of this room
            arrays[f"{name} in the inertia {row} {column}"] = values
    facts = {
        "kind": KIND,
        "format": FORMAT,
        "settings": result.settings,
        "elements": [_plain_element(element) for element in merging.elements],
        "merging": {name: getattr(merging, name) for name in ("step", "samples", "trials", "masses", "is_part")},
        "sampling": [merging.sampling.period, merging.sampling.start],
        "inertia": list(merging.inertia),
        "units": result.units,
        "kinds": result.kinds,
        "constants": result.constants,
        "expansions": plain_curves(result.expansions),
        "tests": result.tests,
        "jumps": result.jumps,
        "trial_spread": {name: [one.tolist() for one in pair] for name, pair in result.trial_spread.items()},
        "identifiable": {name: asdict(one) for name, one in result.identifiable.items()},
        "record_status": int(result.record_status),
        "held_back": {name: np.asarray(one).tolist() for name, one in asdict(result.held_back()).items()},
        "explained": result._share,  # noqa: SLF001 - of this room
        "distrusted": result._distrusted,  # noqa: SLF001 - likewise
        "words": plain_words(result._told),  # noqa: SLF001 - of this room
        "scans": [plain_scan(scan) for scan in result.scans],
        "between": between,
    }
    write_result(path, arrays, result.units, json.dumps(facts))


def _plain_element(element: Element) -> dict[str, Any]:
    """Return an element as JSON has it; functions are with their curves."""
    value = element.value if element.expansion is None else "expanded"
    return {"name": element.name, "of": element.of, "entries": element.entries, "value": value}


def entries_of(pattern: Array) -> list[tuple[tuple[int, int], Array]]:
    """Return the entries of matrices over time, and where each stands."""
    masses = len(pattern)
    return [((row, column), pattern[row, column]) for row in range(masses) for column in range(masses)]
