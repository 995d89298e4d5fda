"""What a record does not tell of a lag of its torque, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tvident import _core
from tvident._arguments import listed
from tvident._equation import COEFFICIENTS
from tvident._results import UNTOLD_LAG
from tvident._status import Status

_HALF = 0.5
"""Samples by which a torque is early that a drive holds from one sample to the next, and is recorded when it begins."""

_LEAST_ERRORS = 2.0
_LEAST_PART = 0.02
"""What it changes is said from so many standard errors of a parameter and from this part of it on."""


def untold_lag(found: _core.Identification, names: Sequence[str], period: float) -> list[str]:
    """Return which parameters half a sample of lag would change, where the record does not tell it.

    Parameters
    ----------
    found : _core.Identification
        In weak form, with a lag that was given.
    names : sequence of str
        What its unknowns are called.
    period : float
        Seconds from one sample to the next.
    """
    if Status.SCALES_DISAGREE in Status(found.record_status):
        # Nothing of such a record is to be believed.
        return []
    lag = next((one for one in found.suspects if one.name == "lag"), None)
    if lag is None or lag.conspicuous or _core.CONSPICUOUS * lag.stderr < _HALF:
        return []
    changed = []
    for place, by_sample in found.with_lag:
        one, change = found.unknowns[place], abs(_HALF * by_sample)
        if not np.isfinite(one.values).any() or not np.isfinite(one.stderr).any():
            continue
        value, error = np.nanmedian(np.abs(one.values)), np.nanmedian(one.stderr) * one.factor
        if names[place] in COEFFICIENTS and change > max(_LEAST_ERRORS * error, _LEAST_PART * value):
            changed.append(f"{names[place]} by {100 * change / value:.2g} %")
    if not changed:
        return []
    words = (
        f"{UNTOLD_LAG}, which alone changes {listed(changed)}: if a drive holds each torque until the next sample, give "
        f"lag={-_HALF * period:.3g} (seconds); give lag='auto' to have errors hold whatever the lag is; if both channels are sampled at "
        "the same time, nothing need be done"
    )
    return [words]
