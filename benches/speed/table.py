"""The table: measured rows as lines of Markdown, printed and stored."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from speed.rows import Row
from speed.timing import Timings

_FIRST, _LAST = "<!-- table: begin -->", "<!-- table: end -->"

HEADER = [
    "| name | work | against | ours | theirs | ratio (quartiles) | by processor time | at most | aim | met |",
    "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |",
]


@dataclass(frozen=True)
class Measured:
    """One row with its times."""

    row: Row
    timings: Timings
    samples: int

    def sides(self) -> tuple[int, int]:
        """Return which works the ratio compares."""
        if self.row.slowest_over_fastest:
            medians = np.median(self.timings.wall, axis=0)
            return int(medians.argmax()), int(medians.argmin())
        return 0, 1

    def met(self) -> bool | None:
        """Return whether the ratio is small enough, or None where none is asked for.

        On one thread both ratios must be. On a busy machine the clock favours the shorter call: the longer one is interrupted more often.
        """
        if self.row.most is None:
            return None
        clocks = [self.timings.wall] if self.row.threads > 1 else [self.timings.wall, self.timings.processor]
        return all(float(np.median(self._ratios(times))) <= self.row.most for times in clocks)

    def line(self) -> str:
        """Return the row as a line of the table."""
        medians = np.median(self.timings.wall, axis=0)
        low, middle, high = (
            _number(value) for value in np.quantile(self._ratios(self.timings.wall), [0.25, 0.5, 0.75])
        )
        if self.row.slowest_over_fastest:
            costs = [" / ".join(_cost(median, self.samples) for median in medians), ""]
        else:
            costs = [_cost(medians[side], self.samples) for side in self.sides()]
        cells = [
            self.row.name,
            self.row.work,
            self.row.against,
            *costs,
            f"**{middle}** ({low}…{high})",
            _number(float(np.median(self._ratios(self.timings.processor)))),
            "" if self.row.most is None else _number(self.row.most),
            "" if self.row.aim is None else _number(self.row.aim),
            {None: "", True: "yes", False: "**no**"}[self.met()],
        ]
        return f"| {' | '.join(cells)} |"

    def _ratios(self, times: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the ratio in every round."""
        over, under = self.sides()
        return np.asarray(times[:, over] / times[:, under])


def _number(value: float) -> str:
    return f"{value:.3f}" if value < 1 else f"{value:.2f}"


def _cost(seconds: float, samples: int) -> str:
    """Return a time a sample."""
    nanoseconds = seconds / samples * 1e9
    return f"{nanoseconds:.1f} ns" if nanoseconds < 100 else f"{nanoseconds:.0f} ns"  # noqa: PLR2004 - three digits


def missing(row: Row) -> str:
    """Return the line of a row that this processor cannot run."""
    return f"| {row.name} | {row.work} | {row.against} | | | no {row.instructions} here | | | | |"


def store(readme: Path, lines: list[str]) -> None:
    """Put lines between the markers of a document, in place of what stood there.

    Raises
    ------
    ValueError
        If the document has no markers.
    """
    text = readme.read_text(encoding="utf-8")
    before, first, rest = text.partition(_FIRST)
    _, last, after = rest.partition(_LAST)
    if not (first and last):
        raise ValueError(f"{readme} must hold {_FIRST} and {_LAST}; it does not; add them where the table belongs")
    body = "\n".join(lines)
    readme.write_text(f"{before}{first}\n\n{body}\n\n{last}{after}", encoding="utf-8")
