# Identification of what repeated trials and coupled masses share.

from collections.abc import Callable, Sequence
from typing import final

import numpy as np
import numpy.typing as npt

from tvident._core_stubs.identification import ConstancyTest, Estimate, Scan, TriedLength

@final
class MergedElement:
    @property
    def element(self) -> int: ...
    @property
    def kind(self) -> str: ...
    @property
    def values(self) -> npt.NDArray[np.float64]: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...
    @property
    def test(self) -> ConstancyTest | None: ...
    @property
    def spread(self) -> list[Estimate]: ...

@final
class MergedIdentification:
    @property
    def window_length(self) -> int: ...
    @property
    def exponent(self) -> int: ...
    @property
    def regression_window(self) -> int: ...
    @property
    def lengths(self) -> list[TriedLength]: ...
    @property
    def prediction_error(self) -> float: ...
    @property
    def misfit(self) -> float: ...
    @property
    def noise(self) -> tuple[list[float], list[float]]: ...
    @property
    def colours(self) -> list[float]: ...
    @property
    def elements(self) -> list[MergedElement]: ...
    @property
    def constants(self) -> list[int]: ...
    @property
    def covariance(self) -> list[float]: ...
    @property
    def covariances(self) -> dict[tuple[int, int], npt.NDArray[np.float64]]: ...
    @property
    def condition(self) -> float: ...
    @property
    def weakest(self) -> list[float]: ...
    @property
    def residual(self) -> npt.NDArray[np.float64]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def record_status(self) -> int: ...
    @property
    def jumps(self) -> list[int]: ...
    @property
    def scan(self) -> Scan: ...

def identify_merged(
    trials: Sequence[
        tuple[
            npt.NDArray[np.number],
            npt.NDArray[np.number],
            npt.NDArray[np.number] | None,
            npt.NDArray[np.bool_] | None,
            npt.NDArray[np.float64] | None,
            npt.NDArray[np.float64] | None,
        ]
    ],
    elements: Sequence[tuple[Sequence[tuple[int, int | None, int, float]], float | None, str]],
    samples: int,
    *,
    delta: float,
    window_length: int | None = None,
    exponent: int | None = None,
    regression_window: int | None = None,
    noise: tuple[list[float], list[float]] | None = None,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> MergedIdentification: ...
