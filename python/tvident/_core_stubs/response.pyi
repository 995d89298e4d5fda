# The response of known systems to a torque, and their free vibration.

from typing import final

import numpy as np
import numpy.typing as npt

@final
class Responses:
    @property
    def angle(self) -> npt.NDArray[np.float64]: ...
    @property
    def velocity(self) -> npt.NDArray[np.float64]: ...
    @property
    def lost(self) -> list[int | None]: ...

@final
class Modes:
    @property
    def poles(self) -> npt.NDArray[np.complex128]: ...
    @property
    def shapes(self) -> npt.NDArray[np.complex128]: ...
    @property
    def lefts(self) -> npt.NDArray[np.complex128]: ...

def respond(
    coefficients: list[npt.NDArray[np.number] | float],
    terms: list[tuple[str, npt.NDArray[np.number] | float]],
    torque: npt.NDArray[np.number],
    *,
    delta: float,
    lag: list[float],
    bridged: int,
    angle: npt.NDArray[np.number] | None = None,
    initial: list[list[float]] | None = None,
    spans: list[tuple[int, int, int]] | None = None,
    stribeck: list[float] | None = None,
    workers: int | None = None,
) -> Responses: ...
def modes(
    inertia: npt.NDArray[np.float64],
    damping: npt.NDArray[np.float64],
    stiffness: npt.NDArray[np.float64],
    workers: int | None = None,
) -> Modes: ...
