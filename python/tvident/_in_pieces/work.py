"""What is done with one piece of a long record: windows with the numbers of the whole record, or a record of its own with neighbours."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._identify import Held, Long, Span, StrongForm
from tvident._in_pieces.merged import Mean, moved
from tvident._in_pieces.recorded import Recording
from tvident._results import Estimates, Identification

Columns = dict[str, npt.NDArray[Any]]

Report = Callable[[int, int], object] | None

SHARED = "_shared_"
"""How columns begin that are kept until the constants of all pieces are known."""

_LEAST_REACH = 4096
"""Neighbours of a piece that is a record of its own, at least."""

_REACH = 4
"""And so many regression windows: averaged windows are longer than the best one."""


class Work(Protocol):
    """Finds the numbers of a piece."""

    def piece(self, wanted: Span, report: Report) -> tuple[Columns, Any]:
        """Return columns of the samples of a piece, and a note for those of others."""

    def finished(self, columns: Columns, note: Any, means: Mapping[str, Mean]) -> Columns:
        """Return the columns that are written, when the notes of all pieces are known."""


def columns_of(found: Estimates) -> Columns:
    """Return what every sample has, by the names of the columns of a result."""
    columns: Columns = {}
    for name, values in found.values.items():
        error = found.errors[name]
        columns[name] = values
        columns[f"{name}_stderr"] = error * found.factors[name] if name in found.factors else error
    columns |= {"condition": found.condition, "residual_std": found.residual_std}
    return columns | {"order": found.order, "status": found.status}


@dataclass(frozen=True)
class Windows:
    """Windows of the strong form: every piece has the bits that it has in the whole record.

    Parameters
    ----------
    recording : Recording
    long : Long
    factors : sequence of float
        Of standard errors, one an unknown.
    alone : Alone, optional
        What is done with a piece in which samples are missing.
    step : int
    workers : int, optional
    """

    recording: Recording
    long: Long
    factors: Sequence[float]
    alone: Alone | None
    step: int
    workers: int | None

    def piece(self, wanted: Span, report: Report) -> tuple[Columns, Any]:
        """Return columns of the samples of a piece; nothing is to be noted of it."""
        held = self.recording.held([self.long.around(wanted)])
        if self.alone is not None and not held.is_whole:
            return self.alone.piece(wanted, report)[0], None
        found = self.long.windows(held, wanted, self.factors, self.workers, report)
        return {"time": self.recording.times(*wanted, self.step), **columns_of(found)}, None

    def finished(self, columns: Columns, note: Any, means: Mapping[str, Mean]) -> Columns:
        """Return the columns as they are."""
        del note, means
        return columns


@dataclass(frozen=True)
class Alone:
    """Pieces that are records of their own, with neighbours on both sides; constants are put together in the end.

    Parameters
    ----------
    recording : Recording
    identified : callable
        Identifies angle and torque with settings that do not depend on the piece.
    reach : int
        Neighbours on each side.
    step : int
    """

    recording: Recording
    identified: Callable[[Held, Report], Identification]
    reach: int
    step: int

    def piece(self, wanted: Span, report: Report) -> tuple[Columns, Any]:
        """Return columns of the samples of a piece, and its constants with their covariance."""
        samples = self.recording.samples
        span = with_neighbours(wanted, self.reach, samples, self.step)
        result = self.identified(self.recording.held([span]), report)
        columns, note = part_alone(result, span, wanted, self.step)
        if span[1] - span[0] == samples:
            note |= {"settings": result.settings, "advice": list(result.advice)}
        return {"time": self.recording.times(*wanted, self.step), **columns}, note

    def finished(self, columns: Columns, note: Any, means: Mapping[str, Mean]) -> Columns:
        """Return the columns with the constants of all pieces."""
        return finished(columns, note, means)


def with_neighbours(wanted: Span, reach: int, samples: int, step: int) -> Span:
    """Return the samples of a piece that is a record of its own: it begins where a result is wanted."""
    return max(wanted[0] - reach, 0) // step * step, min(wanted[1] + reach, samples)


def part_alone(result: Identification, span: Span, wanted: Span, step: int) -> tuple[Columns, dict[str, Any]]:
    """Return columns of the wanted samples of a span that was identified on its own, and its constants with their covariance."""
    found = result._found  # noqa: SLF001 - what a result is made of
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
        "record_status": int(result.record_status),
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
    window, rows = int(settings["window_length"]), settings.get("regression_window")
    if settings["form"] == "strong":
        return 3 * window + 2 * int(rows or 0) + int(abs(settings["lag"] or 0) * settings["sample_rate"])
    return max(_LEAST_REACH, window + _REACH * (rows if isinstance(rows, int) else 0))


def is_strong(method: object) -> bool:
    """Return whether a method is the strong form."""
    return isinstance(method, StrongForm) or method == "paper"
