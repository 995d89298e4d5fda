"""Channels as they were used: without spikes, and without samples that count as missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tvident import _core
from tvident._identify.data import Data


def as_used(data: Data, found: Sequence[_core.Identification]) -> Data:
    """Return the data as they were used: copies where there were spikes, clipped or lost samples, with what took their place.

    Parameters
    ----------
    data : Data
    found : sequence of _core.Identification
        Of every record.
    """
    if not any(one.spikes or one.lost or any(one.limits) or any(one.unread) for one in found):
        return data
    channels: list[Any] = [np.array(one, np.float64) for one in (data.angles, data.torques)]
    rows = [one.reshape(-1, one.shape[-1]) for one in channels]
    for record, one in enumerate(found):
        for spike in one.spikes:
            rows[spike.channel][record, spike.sample] = spike.value
        for rows_of_one, places in zip(rows, one.unread, strict=True):
            rows_of_one[record, places] = np.nan
        rows[0][record, one.lost] = np.nan
        for rows_of_one, limits in zip(rows, one.limits, strict=True):
            if limits:
                channel, (least, most) = rows_of_one[record], limits
                channel[(channel <= least) | (channel >= most)] = np.nan
    return replace(data, angles=channels[0], torques=channels[1])
