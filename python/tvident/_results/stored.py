"""Results in files, from which they come back as they were, to the last bit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tvident._arguments import Labels, labels_in, labels_out
from tvident._equation import COEFFICIENTS
from tvident._files import FileError, write_result
from tvident._results.estimates import Estimates
from tvident._results.scan import Scan
from tvident._results.stored_curves import curves_from, plain_curves
from tvident._results.words import Words
from tvident._status import Status

if TYPE_CHECKING:
    from tvident._tables import Table

_FORMAT = 1
"""Files of another number hold other things."""

Arrays = dict[str, npt.NDArray[Any]]


def store(path: Path, table: Table, found: Estimates, rest: Mapping[str, Any]) -> None:
    """Write a result: its columns, what else has one value a sample, and the rest as JSON."""
    arrays, facts = plain_result(table, found, rest)
    write_result(path, arrays, found.units, json.dumps(facts))


def plain_result(table: Table, found: Estimates, rest: Mapping[str, Any]) -> tuple[Arrays, dict[str, Any]]:
    """Return what files hold of a result: arrays by name, and the rest as JSON has it.

    Parameters
    ----------
    table : Table
        The columns that everybody reads.
    found : Estimates
    rest : mapping
        Words, jumps and the names of terms.
    """
    arrays: Arrays = {"time": table.time, **table.columns}
    for name in found.factors:
        arrays[f"{name}_stderr_before_factor"] = found.errors[name]
    for one, other in combinations(COEFFICIENTS, 2):
        covariance = found.covariances.get(frozenset((one, other)))
        if covariance is not None:
            arrays[f"{one}_{other}_covariance"] = covariance
    more, labels = labels_out(found.labels)
    flags = np.asarray(found.record_status)
    facts = {
        "format": _FORMAT,
        "settings": table.settings,
        "factors": {name: factor.tolist() for name, factor in found.factors.items()},
        "constants": {name: [np.asarray(one).tolist() for one in pair] for name, pair in found.constants.items()},
        "kinds": {name: np.asarray(kind).tolist() for name, kind in found.kinds.items()},
        "in_common": {name: np.asarray(part).tolist() for name, part in found.in_common.items()},
        "record_status": flags.tolist(),
        "scans": [plain_scan(scan) for scan in found.scans],
        "labels": labels,
        "units": dict(found.units),
        "expansions": plain_curves(found.expansions),
        "is_part": found.is_part,
        **rest,
    }
    return {**arrays, **more}, facts


def restored(place: str, arrays: Arrays, facts: Mapping[str, Any]) -> Estimates:
    """Return the estimates that `store` wrote to a file that is called `place`."""
    if facts["format"] != _FORMAT:
        raise FileError(f"{place}: holds a result of another version; identify again with the version at hand")
    return _estimates(arrays, facts)


def _estimates(arrays: Arrays, facts: Mapping[str, Any]) -> Estimates:
    names = [*COEFFICIENTS, *facts["terms"], *facts["settings"]["inner"]]
    factors = {name: np.asarray(factor, np.float64) for name, factor in facts["factors"].items()}
    errors = {name: arrays[f"{name}_stderr_before_factor" if name in factors else f"{name}_stderr"] for name in names}
    batch = arrays["status"].shape[:-1]

    def number(value: Any) -> Any:
        return np.asarray(value) if batch else float(value)

    covariances = {
        frozenset(pair): arrays[f"{pair[0]}_{pair[1]}_covariance"]
        for pair in combinations(COEFFICIENTS, 2)
        if f"{pair[0]}_{pair[1]}_covariance" in arrays
    }
    flags = facts["record_status"]
    return Estimates(
        values={name: arrays[name] for name in names},
        errors=errors,
        factors=factors,
        covariances=covariances,
        constants={name: (number(one), number(other)) for name, (one, other) in facts["constants"].items()},
        condition=arrays["condition"],
        residual_std=arrays["residual_std"],
        order=arrays["order"],
        status=arrays["status"],
        record_status=np.asarray(flags, np.uint16) if batch else Status(flags),
        scans=tuple(scan_from(scan) for scan in facts["scans"]),
        labels=_labels(arrays, facts),
        kinds={name: np.asarray(kind) for name, kind in facts["kinds"].items()},
        in_common={name: number(part) for name, part in facts.get("in_common", {}).items()},
        units=facts["units"],
        expansions=curves_from(facts.get("expansions", {})),
        is_part=facts.get("is_part", False),
    )


def _labels(arrays: Arrays, facts: Mapping[str, Any]) -> Labels | None:
    return None if facts["labels"] is None else labels_in(arrays, facts["labels"])


def plain_scan(scan: Scan) -> dict[str, Any]:
    """Return a scan as JSON has it."""
    return {
        "window_length": scan.window_length.tolist(),
        "band": scan.band.tolist(),
        "estimates": {name: values.tolist() for name, values in scan.estimates.items()},
        "stderr": {name: values.tolist() for name, values in scan.stderr.items()},
        "plateau": scan.plateau,
        "corrected": scan.corrected,
        "moved": scan.moved,
    }


def scan_from(plain: Mapping[str, Any]) -> Scan:
    """Return a scan from JSON."""
    estimates, stderr = (
        {name: np.asarray(values, np.float64) for name, values in plain[of].items()} for of in ("estimates", "stderr")
    )
    return Scan(
        window_length=np.asarray(plain["window_length"], np.int64),
        band=np.asarray(plain["band"], np.float64),
        estimates=estimates,
        stderr=stderr,
        plateau=None if plain["plateau"] is None else (plain["plateau"][0], plain["plateau"][1]),
        corrected=plain["corrected"],
        moved=plain["moved"],
    )


def plain_words(words: Words) -> dict[str, Any]:
    """Return reasons and advice as JSON has them."""
    return {"reasons": words.reasons, "advice": words.advice, "each": [plain_words(one) for one in words.each]}


def words_from(plain: Mapping[str, Any]) -> Words:
    """Return reasons and advice from JSON."""
    return Words(tuple(plain["reasons"]), tuple(plain["advice"]), tuple(words_from(one) for one in plain["each"]))
