"""Samples that wait for others cost little while they do."""

from __future__ import annotations

import math

from tvident._live.rate import Came, Lateness
from tvident._live.waiting import Waiting


def test_samples_that_wait_are_asked_once_a_buffer() -> None:
    """All that waited, up to 2000, were looked at for each sample: 1.2 ms where 64 at 1 kHz came 3 ms late and some were lost."""

    class Counted(Lateness):
        asked = 0

        def is_no_chance(self, earliest: float, buffers: float) -> bool:
            self.asked += 1
            return super().is_no_chance(earliest, buffers)

    lateness, waiting = Counted(), Waiting()
    for late in (4.0, 4.0, 4.0):
        lateness.see(late)
    # The latest is the least late: none of those before it comes before a loss.
    for place in range(2000):
        waiting.add(Came((place * 1e-3, 0.0, 0.0), begins=place % 50 == 0), 3.0 - place / 1000)
        assert waiting.late_alone(50, lateness) == 0
    buffers = 2000 // 50
    assert 0 < lateness.asked <= buffers * (buffers + 1) // 2
    assert waiting.telling == 2000
    assert math.isclose(waiting.earliest, 3.0 - 1.999)
