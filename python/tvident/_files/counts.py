"""Times of a file that may be numbers of samples, whatever their header says."""

from __future__ import annotations

from collections.abc import Iterator

from tvident._files.channels import Channels
from tvident._files.names import printable
from tvident._units import ROTARY, factor_to, may_count_samples, named_unit, unit_said


def said_of_counts(channels: Channels) -> Iterator[str]:
    """Give questions about channels in microseconds, or less, that go up by one from sample to sample."""
    for name, values in channels.items():
        unit = named_unit(name)[1] or unit_said(values)
        if may_count_samples(values, unit):
            rate = 1 / factor_to(ROTARY, "time", unit, name="the time")
            yield (
                f"channel '{printable(name, 40)}' goes up by one from sample to sample, which is read as {rate:.6g} Hz; if it counts "
                "samples, give sample_rate= in place of its times"
            )
