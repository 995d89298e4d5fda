"""How often each flag occurs."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._status.flags import Status


def describe(status: npt.NDArray[Any], record_status: npt.ArrayLike = 0) -> list[str]:
    """Return a line for every flag that occurs: how often, and what it means; then the names of those of the records."""
    if not status.size:
        return ["no samples"]
    lines = [f"{np.count_nonzero(status == 0) / status.size:6.1%}  good"]
    there = int(np.bitwise_or.reduce(status, axis=None))
    shares = {flag: np.count_nonzero(status & np.uint16(flag)) / status.size for flag in Status if there & flag}
    lines += [f"{share:6.1%}  {flag.name}: {flag.advice}" for flag, share in shares.items()]
    records = np.atleast_1d(np.asarray(record_status))
    counts = {flag: int(np.count_nonzero(records & flag)) for flag in Status}
    for flag, count in counts.items():
        if count:
            which = "record" if records.size == 1 else f"{count} of {records.size} records"
            lines.append(f"{which:>6}  {flag.name}")
    return lines
