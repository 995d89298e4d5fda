# Local polynomials in windows of samples, with times of their own or without.

from collections.abc import Callable, Sequence
from typing import final

import numpy as np
import numpy.typing as npt

@final
class LocalPolynomials:
    def __new__(
        cls,
        window_length: int,
        order: int | None,
        max_order: int,
        criterion: str,
        selection: str,
        derivatives: list[int],
        delta: float,
        noise: bool,
        quantisation: float,
    ) -> LocalPolynomials: ...
    @property
    def orders(self) -> int: ...
    def estimate(
        self,
        samples: npt.NDArray[np.number],
        *,
        ends: bool = True,
        step: int = 1,
        part: tuple[tuple[int, int], tuple[int, int], int] | None = None,
        workers: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> LocalEstimates: ...
    def estimate_incomplete(
        self,
        samples: npt.NDArray[np.number],
        places: Sequence[int],
        longest_gap: int,
        least: int,
        *,
        weights: npt.NDArray[np.float64] | None = None,
        workers: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> IncompleteEstimates: ...
    def errors(
        self,
        samples: npt.NDArray[np.number],
        *,
        step: int = 1,
        part: tuple[tuple[int, int], tuple[int, int], int] | None = None,
        workers: int | None = None,
    ) -> npt.NDArray[np.float64]: ...
    def scores(self, samples: npt.NDArray[np.number], sample: int) -> npt.NDArray[np.float64]: ...

@final
class LocalEstimates:
    @property
    def derivatives(self) -> npt.NDArray[np.float64]: ...
    @property
    def order(self) -> npt.NDArray[np.uint8]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def sigma(self) -> npt.NDArray[np.float64]: ...

@final
class IncompleteEstimates:
    @property
    def derivatives(self) -> npt.NDArray[np.float64]: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...
    @property
    def order(self) -> npt.NDArray[np.uintp]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def sigma(self) -> npt.NDArray[np.float64]: ...

@final
class AutomaticEstimates:
    @property
    def derivatives(self) -> npt.NDArray[np.float64]: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...
    @property
    def order(self) -> npt.NDArray[np.uint8]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def chosen(self) -> list[list[tuple[int, int]]]: ...
    @property
    def noise(self) -> list[tuple[float, float]]: ...

@final
class WindowFit:
    def __new__(
        cls,
        times: npt.NDArray[np.float64],
        window_length: float,
        *,
        order: int | None,
        max_order: int,
        criterion: str,
        derivatives: int,
        quantisation: float,
        weights: npt.NDArray[np.float64] | None = None,
        least: int = ...,
    ) -> WindowFit: ...
    def estimate(
        self,
        samples: npt.NDArray[np.number],
        *,
        errors: bool = False,
        step: int = 1,
        workers: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> WindowEstimates: ...
    def scores(self, samples: npt.NDArray[np.number], sample: int) -> npt.NDArray[np.float64]: ...

@final
class WindowEstimates:
    @property
    def estimates(self) -> LocalEstimates: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64] | None: ...

def estimate_automatically(
    samples: npt.NDArray[np.number],
    derivatives: list[int],
    highest: int,
    fixed: bool,
    delta: float,
    quantisation: float | None,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> AutomaticEstimates: ...
def sliding_velocity(
    angle: npt.NDArray[np.number], delta: float, *, workers: int | None = None
) -> npt.NDArray[np.float64]: ...
