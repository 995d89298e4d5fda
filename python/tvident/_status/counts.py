"""How often each flag occurs."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._status.flags import _OF_THE_RECORD, Status


def describe(status: npt.NDArray[Any]) -> list[str]:
    """Return a line for every flag that occurs: how often, and what it means."""
    if not status.size:
        return ["no samples"]
    shares = {flag: float(np.mean(status & flag != 0)) for flag in Status}
    everywhere = [flag for flag in _OF_THE_RECORD if shares[flag] == 1]
    own = np.uint16(0xFFFF & ~sum(everywhere))
    lines = [
        f"{float(np.mean(status & own == 0)):6.1%}  good"
        + (" but for what holds for the whole record" if everywhere else "")
    ]
    lines += [
        f"{shares[flag]:6.1%}  {flag.name}: {flag.advice}"
        for flag in Status
        if shares[flag] > 0 and flag not in everywhere
    ]
    if everywhere:
        lines.append(f"record  {', '.join(flag.name or '' for flag in everywhere)}: see what to do, or tvident.Status")
    return lines
