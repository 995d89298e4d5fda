"""Samples of a live recording that wait until others say whether samples were lost before them."""

from __future__ import annotations

import math

from tvident._live.rate import HALF, MOVES, Came, Lateness

_AGREE = 8
"""Buffers that agree on what was lost before them."""


class Waiting:
    """Samples in the order in which they came, and by how many periods each is late.

    Some thousand may wait, and each that comes asks again: what is asked of all of them is kept.
    """

    def __init__(self) -> None:
        self.came: list[Came] = []
        self.telling = 0
        """Samples whose stamps tell anything."""
        self.earliest, self.latest = math.inf, -math.inf
        """Periods by which they are late: of the one that is least late, and most."""
        self._heads: list[tuple[int, float]] = []
        """Places of those that tell anything, and how late they are."""
        self._begun: list[tuple[int, float]] = []
        """The same of the first, and of those that begin a buffer."""
        self._asked = (0, 0)
        """How many of these there were, and of how many samples a buffer was, when nothing was late alone."""

    def add(self, came: Came, off: float) -> None:
        """Add a sample that is late by so many periods, if its stamp tells anything."""
        head = len(self.came), off
        self.came.append(came)
        self.telling += came.tells
        if not (came.tells and math.isfinite(off)):
            return
        self.earliest, self.latest = min(self.earliest, off), max(self.latest, off)
        if came.begins or not self._heads:
            self._begun.append(head)
        self._heads.append(head)

    def parted(self, count: int) -> tuple[list[Came], list[Came]]:
        """Return the first so many samples, and the others."""
        return self.came[:count], self.came[count:]

    @property
    def is_due(self) -> bool:
        """Whether nothing was lost or repeated before them: one of them is not off, or some are late and some early."""
        return self.earliest < HALF and self.latest > -HALF

    def late_alone(self, length: int, lateness: Lateness) -> int:
        """Return how many samples come before a loss: no later than others were before, while all that follow are later.

        Parameters
        ----------
        length : int
            Samples of a buffer.
        lateness : Lateness
            Of the samples before those that wait.
        """
        heads = self._begun if length > 1 else self._heads
        # Samples within a buffer tell nothing more.
        if not heads or self._asked == (len(heads), length):
            return 0
        self._asked = len(heads), length
        rest, least, most = math.inf, math.inf, 0.0
        later = [rest := min(rest, off) for _, off in reversed(heads)][::-1]
        # What the last of them agree on is what was lost before the first that is followed by none which is less late.
        lost = math.floor(later[-min(_AGREE, len(heads))] + HALF) - MOVES
        for count, (head, off) in enumerate(heads):
            if later[count] >= lost:
                return head if count else 0
            least, most = min(least, off), max(most, off)
            if not HALF <= most <= lateness.usual or lateness.is_no_chance(least, count + 1):
                return 0
        return 0
