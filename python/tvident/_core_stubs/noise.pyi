# The noise of channels, its colour and its quantisation, and channels brought onto a uniform grid.

from collections.abc import Sequence
from typing import final

import numpy as np
import numpy.typing as npt

@final
class PassedNoise:
    @property
    def gain(self) -> float: ...

@final
class Resampling:
    def __new__(
        cls,
        times: npt.NDArray[np.float64],
        grid: int,
        *,
        order: int,
        bridged: float,
        propagate: bool = False,
    ) -> Resampling: ...
    def onto_grid(self, samples: npt.NDArray[np.number], *, workers: int | None = None) -> npt.NDArray[np.float64]: ...
    def at(self, samples: npt.NDArray[np.number], wanted: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]: ...
    def gain(self, *, workers: int | None = None) -> float: ...
    def passed_noise(self, *, records: int = ..., workers: int | None = None) -> PassedNoise: ...

@final
class Noise:
    @property
    def sigma(self) -> float: ...
    @property
    def quantisation(self) -> float: ...

def noise(
    samples: npt.NDArray[np.number],
    quantisation: float | None = None,
    passed: PassedNoise | None = None,
    weights: npt.NDArray[np.float64] | None = None,
) -> list[Noise]: ...
def noise_coherence(
    angle: npt.NDArray[np.number],
    torque: npt.NDArray[np.number],
    variances: list[float],
    inertias: list[float],
    lags: list[float],
) -> list[float | None]: ...
def fuse(
    record: npt.NDArray[np.number],
    others: Sequence[tuple[int, float, npt.NDArray[np.number]]],
    delta: float,
) -> npt.NDArray[np.float64]: ...
def break_counts(angle: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> list[list[int]]: ...
def spike_counts(angle: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> list[list[int]]: ...
def unread_counts(angle: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> list[list[int]]: ...
def parts_of_quantisation(samples: int) -> list[tuple[int, int]]: ...
def quantisation_step(
    samples: npt.NDArray[np.number], *, parts: Sequence[tuple[int, int]] | None = None, of: int = 0
) -> float: ...
