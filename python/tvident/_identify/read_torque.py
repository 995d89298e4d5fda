"""A torque that is held: what acts in steps, as that of a digital controller, or readings of a slow sensor. The record decides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tvident._clocks import unheld
from tvident._identify.data import Data
from tvident._results import Identification
from tvident._status import Status


def with_read_torque(data: Data, identified: Callable[[Data], Identification]) -> Data:
    """Return a record with splines between the readings of its torque, where its steps seem to come late and the splines do not.

    Steps that act are no later than what they move. Those of a recorder are late by half of what it holds.

    Parameters
    ----------
    data : Data
    identified : callable
        Identifies a record.
    """
    if data.batch or data.motion.recorded or data.instruments is not None or not data.time.size:
        return data
    read = unheld({"torque": data.torques}, data.period, data.workers, of_torque=True)
    if read is None or not identified(data).record_status & Status.LAG_SUSPECTED:
        return data
    other = replace(
        data,
        torques=read.channels["torque"],
        passed=(data.passed[0], read.passed["torque"]),
        clock=read.after(data.clock),
        doubts=[*data.doubts, *((0, doubt) for doubt in read.doubts)],
    )
    return data if identified(other).record_status & Status.LAG_SUSPECTED else other
