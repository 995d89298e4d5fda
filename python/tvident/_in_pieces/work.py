"""What is done with one piece of a long record: windows with the numbers of the whole record, or a record of its own with neighbours."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from tvident._identify import Held, Long, Span
from tvident._in_pieces.recorded import RecordingOfFile
from tvident._pieces import Columns, Mean, columns_of, finished, part_alone, with_neighbours
from tvident._results import Identification

Report = Callable[[int, int], object] | None


class Identify(Protocol):
    """Identifies some samples as a record of its own."""

    def __call__(self, held: Held, report: Report, *, wanted: Span) -> Identification:
        """Return what is known of the wanted samples, and of constants."""


class Work(Protocol):
    """Finds the numbers of a piece."""

    is_final: ClassVar[bool]
    """Whether columns are written as they are, whatever other pieces say."""

    def piece(self, wanted: Span, report: Report) -> tuple[Columns, Any]:
        """Return columns of the samples of a piece, and a note for those of others."""

    def finished(self, columns: Columns, note: Any, means: Mapping[str, Mean]) -> Columns:
        """Return the columns that are written, when the notes of all pieces are known."""


@dataclass(frozen=True)
class WindowsWork:
    """Windows of the strong form: every piece has the bits that it has in the whole record.

    Parameters
    ----------
    recording : RecordingOfFile
    long : Long
    factors : sequence of float
        Of standard errors, one an unknown.
    alone : Alone, optional
        What is done with a piece in which samples are missing, where that is an error.
    step : int
    workers : int, optional
    """

    is_final: ClassVar[bool] = True

    recording: RecordingOfFile
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
    recording : RecordingOfFile
    identified : callable
        Identifies some samples with settings that do not depend on the piece.
    reach : int
        Neighbours on each side.
    step : int
    """

    is_final: ClassVar[bool] = False

    recording: RecordingOfFile
    identified: Identify
    reach: int
    step: int

    def piece(self, wanted: Span, report: Report) -> tuple[Columns, Any]:
        """Return columns of the samples of a piece, and its constants with their covariance."""
        samples = self.recording.samples
        span = with_neighbours(wanted, self.reach, samples, self.step)
        result = self.identified(self.recording.held([span]), report, wanted=wanted)
        columns, note = part_alone(result, span, wanted, self.step)
        if span[1] - span[0] == samples and result.settings["form"] == "weak":
            note |= {"settings": result.settings, "advice": list(result.advice)}
        return {"time": self.recording.times(*wanted, self.step), **columns}, note

    def finished(self, columns: Columns, note: Any, means: Mapping[str, Mean]) -> Columns:
        """Return the columns with the constants of all pieces."""
        return finished(columns, note, means)
