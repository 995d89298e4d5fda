"""What bringing channels onto a grid makes of white noise, for those who ask."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from tvident import _core


@dataclass(frozen=True, eq=False)
class Passed:
    """What a resampling makes of white noise, computed when first asked for: that takes longer than the channels do.

    Parameters
    ----------
    resampling : Resampling
    workers : int, optional
    """

    resampling: _core.Resampling
    workers: int | None = None

    @cached_property
    def noise(self) -> _core.PassedNoise:
        """What it is, to about one percent."""
        return self.resampling.passed_noise(workers=self.workers)

    def in_short(self) -> _core.PassedNoise:
        """Return what it is to a few percent, for much less."""
        return self.resampling.passed_noise(records=1, workers=self.workers)
