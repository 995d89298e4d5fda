"""What counts samples, or ticks of a clock: times of a file that may be numbers of samples, and counters that nobody calls times."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from tvident._files.channels import Channels
from tvident._files.names import printable
from tvident._units import ROTARY, factor_to, may_count_samples, named_unit, unit_said

_COUNTERS = re.compile(
    r"((sys|system|robot|hal|rtc|timer|loop|control|controller|frame|sample|packet|row)[ _.-]?)?"
    r"(ticks?|cycles?|counts?|counter|frames?|seq(uence)?|samples?|index|number|no|nr|n)",
    re.IGNORECASE,
)
"""What is called so counts something, which may be parts of a second."""


def counters(channels: Channels) -> Iterator[tuple[str, int]]:
    """Give the channels that are called as counters are and go up by equal whole steps, and these."""
    for name, values in channels.items():
        bare, unit = named_unit(name)
        if unit or unit_said(values) or values.ndim != 1 or values.size < 2 or values.dtype.kind not in "iuf":  # noqa: PLR2004 - a step
            continue
        steps = np.diff(np.asarray(values, np.float64))
        if (
            _COUNTERS.fullmatch(bare.rpartition(".")[2])
            and steps[0] >= 1
            and steps[0] % 1 == 0
            and (steps == steps[0]).all()
        ):
            yield name, int(steps[0])


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
