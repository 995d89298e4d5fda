"""A torque that is held: what acts in steps, as that of a digital controller, or readings of a slow sensor. The record decides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tvident._clocks import unheld
from tvident._identify.data import Data
from tvident._results import Identification, unflagged
from tvident._status import Status

_AS_TRUSTED, _LEAST = 0.9, 0.5
"""Part of the samples that must be trusted with splines: of those that are trusted with the steps of a torque, and of all."""


def with_read_torque(data: Data, identified: Callable[[Data], Identification]) -> Data:
    """Return a record with splines between the readings of its torque, where its steps seem to come late and the splines do not.

    Steps that act are no later than what they move. Those of a recorder are late by half of what it holds. Where there is next to no noise,
    a step between two samples seems to be off by a part of one: then splines are worse, and too little is trusted of them to tell a lag.

    Parameters
    ----------
    data : Data
    identified : callable
        Identifies a record.
    """
    if data.batch or data.motion.recorded or data.instruments is not None or not data.time.size:
        return data
    read = unheld({"torque": data.torques}, data.period, data.workers, of_torque=True)
    if read is None:
        return data
    in_steps = identified(data)
    if not in_steps.record_status & Status.LAG_SUSPECTED:
        return data
    other = replace(
        data,
        torques=read.channels["torque"],
        passed=(data.passed[0], read.passed["torque"]),
        clock=read.after(data.clock),
        doubts=[*data.doubts, *((0, doubt) for doubt in read.doubts)],
    )
    between = identified(other)
    least = max(_AS_TRUSTED * float(np.mean(unflagged(in_steps))), _LEAST)
    is_worse = float(np.mean(unflagged(between))) < least
    return data if is_worse or between.record_status & Status.LAG_SUSPECTED else other
