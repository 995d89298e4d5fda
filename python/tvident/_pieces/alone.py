"""A piece that is a record of its own, with neighbours on both sides: its columns, its constants, and both with what all pieces say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._identify import Span
from tvident._pieces.merged import Mean, moved
from tvident._results import Estimates, Identification

Columns = dict[str, npt.NDArray[Any]]

SHARED = "_shared_"
"""How columns begin that are kept until the constants of all pieces are known."""

_LEAST_REACH = 2048
"""Neighbours of a piece that is a record of its own, at least."""

_REACH = 4
"""And so many regression windows: averaged windows are longer than the best one."""


def columns_of(found: Estimates) -> Columns:
    """Return what every sample has, by the names of the columns of a result."""
    columns: Columns = {}
    for name, values in found.values.items():
        error = found.errors[name]
        columns[name] = values
        columns[f"{name}_stderr"] = error * found.factors[name] if name in found.factors else error
    columns |= {"condition": found.condition, "residual_std": found.residual_std}
    return columns | {"order": found.order, "status": found.status}


def with_neighbours(wanted: Span, reach: int, samples: int, step: int) -> Span:
    """Return the samples of a piece that is a record of its own: it begins where a result is wanted."""
    return max(wanted[0] - reach, 0) // step * step, min(wanted[1] + reach, samples)


def part_alone(result: Identification, span: Span, wanted: Span, step: int) -> tuple[Columns, dict[str, Any]]:
    """Return columns of the wanted samples of a span that was identified on its own, and its constants with their covariance."""
    return part_estimated(result._found, span, wanted, step)  # noqa: SLF001 - what a result is made of


def part_estimated(found: Estimates, span: Span, wanted: Span, step: int) -> tuple[Columns, dict[str, Any]]:
    """Return the same of the numbers alone."""
    inside = slice(-((span[0] - wanted[0]) // step), -((span[0] - wanted[1]) // step))
    columns = {name: values[inside] for name, values in columns_of(found).items()}
    constants = {name: [float(one) for one in pair] for name, pair in found.constants.items()}
    names = [name for name in COEFFICIENTS if name in constants]
    changing = [name for name in COEFFICIENTS if name in found.kinds and name not in constants]
    for one in changing:
        for name in names:
            columns[f"{SHARED}{one}_{name}"] = found.covariances[frozenset((one, name))][inside]
    note = {
        "constants": constants,
        "covariance_of": names,
        "covariance": [[_covariance(found, one, other) for other in names] for one in names],
        "changing": changing,
        "record_status": int(found.record_status),
        "samples": wanted[1] - wanted[0],
        "counted": span[1] - span[0],
    }
    return columns, note


def finished(columns: Columns, note: Mapping[str, Any], means: Mapping[str, Mean]) -> Columns:
    """Return the columns of a piece with the constants of all pieces, as far as these agree."""
    written = {name: values for name, values in columns.items() if not name.startswith(SHARED)}
    change = moved(note, means)
    if change is not None:
        shared, of = change
        for name in note["changing"]:
            together = np.stack([columns[f"{SHARED}{name}_{one}"] for one in shared])
            written[name], written[f"{name}_stderr"] = of.of(columns[name], columns[f"{name}_stderr"], together)
    for name, mean in means.items():
        if name in note["constants"] and name in written and mean.agree:
            written[name] = np.full_like(written[name], mean.value)
            written[f"{name}_stderr"] = np.full_like(written[name], mean.error)
    return written


def _covariance(found: Estimates, one: str, other: str) -> float:
    """Return the covariance of two constants."""
    if one == other:
        return float(found.constants[one][1] ** 2)
    value = float(np.ravel(found.covariances[frozenset((one, other))])[0])
    return value if math.isfinite(value) else 0.0


def reach_of(settings: Mapping[str, Any]) -> int:
    """Return how many neighbours a piece needs that is a record of its own."""
    if settings["form"] == "strong":
        window, rows = int(settings["window_length"]), settings.get("regression_window")
        return 3 * window + 2 * int(rows or 0) + int(abs(settings["lag"] or 0) * settings["sample_rate"])
    return max(_LEAST_REACH, look_ahead(settings))


def look_ahead(settings: Mapping[str, Any]) -> int:
    """Return how many neighbours windows around a sample reach in weak form: noise and constants are told by more."""
    rows = settings.get("regression_window")
    return int(settings["window_length"]) + _REACH * (rows if isinstance(rows, int) else 0)
