"""Results of trials and masses as figures take the result of one record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._status import Status

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass
class Drawn:
    """What figures take: every element is a term.

    Parameters
    ----------
    time, inertia : ndarray, shape (n,)
    terms : dict of str to ndarray, shape (n,)
    constants, stderr, units, settings : mapping
    status, order : ndarray, shape (n,)
    record_status : Status
    torques : tuple of ndarray
        Time, recorded and predicted torque of one mass.
    """

    time: Array
    inertia: Array
    terms: dict[str, Array]
    constants: dict[str, tuple[Any, Any]]
    stderr: Mapping[str, Array]
    status: npt.NDArray[np.uint16]
    record_status: Status
    order: npt.NDArray[np.uint8]
    settings: dict[str, Any]
    units: Mapping[str, str]
    torques: tuple[Array, Array, Array] | None = None

    def predicted_torque(self) -> tuple[Array, Array, Array]:
        """Return time, the recorded torque and the predicted one."""
        if self.torques is None:
            raise ValueError("a torque must be there to be drawn; got none; identify again")
        return self.torques


def drawn(result: Any, torques: tuple[Array, Array, Array] | None = None) -> Any:
    """Return a result of trials or masses as figures take it; what is not known by name is left out."""
    shown = {name: kind if kind in {"constant", "windowed"} else "known" for name, kind in result.kinds.items()}
    return Drawn(
        time=result.time,
        inertia=np.zeros(result.time.size),
        terms=dict(result.elements),
        constants=result.constants,
        stderr=result.stderr,
        status=result.status,
        record_status=result.record_status,
        order=np.zeros(result.time.size, np.uint8),
        settings={**result.settings, "kinds": {**dict.fromkeys(COEFFICIENTS, "known"), **shown}},
        units=result.units,
        torques=torques,
    )
