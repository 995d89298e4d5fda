"""Channels without the spikes that were found in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tvident import _core
from tvident._identify.data import Data


def without_spikes(data: Data, found: Sequence[_core.Identification]) -> Data:
    """Return the data as they were used: copies where there were spikes, with what took their place.

    Parameters
    ----------
    data : Data
    found : sequence of _core.Identification
        Of every record.
    """
    if not any(one.spikes for one in found):
        return data
    channels: list[Any] = [np.array(one, np.float64) for one in (data.angles, data.torques)]
    rows = [one.reshape(-1, one.shape[-1]) for one in channels]
    for record, one in enumerate(found):
        for channel, sample, instead in one.spikes:
            rows[channel][record, sample] = instead
    return replace(data, angles=channels[0], torques=channels[1])
