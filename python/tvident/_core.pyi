from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "FEWEST_SAMPLES",
    "HARDLY_TOLD_APART",
    "NOISE_MODEL_FAILS",
    "NO_CHANCE",
    "LocalPolynomials",
    "Motions",
    "available_instructions",
    "estimate_automatically",
    "force_instructions",
    "identify_constant",
    "identify_strong",
    "identify_weak",
    "identify_windowed",
    "instructions",
    "noise",
    "quantisation_step",
    "rolling_least_squares",
    "status_flags",
]

FEWEST_SAMPLES: int
HARDLY_TOLD_APART: float
NOISE_MODEL_FAILS: float
NO_CHANCE: float

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
        workers: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8], npt.NDArray[np.uint16], npt.NDArray[np.float64]]: ...
    def errors(
        self, samples: npt.NDArray[np.number], *, step: int = 1, workers: int | None = None
    ) -> npt.NDArray[np.float64]: ...
    def scores(self, samples: npt.NDArray[np.number], sample: int) -> npt.NDArray[np.float64]: ...

@final
class Motions:
    def __new__(
        cls,
        angle: npt.NDArray[np.number],
        torque: npt.NDArray[np.number],
        coefficients: list[npt.NDArray[np.number] | float | None],
        terms: list[npt.NDArray[np.number] | str],
    ) -> Motions: ...

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
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.uint8],
    npt.NDArray[np.uint16],
    list[list[tuple[int, int]]],
    list[tuple[float, float]],
]: ...
def identify_windowed(
    plan: LocalPolynomials,
    motions: Motions,
    equations: int,
    pairs: list[tuple[int, int]],
    *,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.uint16],
    npt.NDArray[np.uint8],
    npt.NDArray[np.float64],
]: ...
def identify_constant(
    plan: LocalPolynomials,
    motions: Motions,
    *,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.uint16],
    npt.NDArray[np.uint8],
]: ...
def noise(samples: npt.NDArray[np.number], quantisation: float | None = None) -> tuple[list[float], list[float]]: ...
def quantisation_step(samples: npt.NDArray[np.number]) -> float: ...
def identify_strong(
    plan: LocalPolynomials,
    motions: Motions,
    record: int,
    kinds: Sequence[str],
    *,
    equations: int,
    linear: bool = False,
    filter_torque: bool = False,
    lag: float = 0.0,
    mask: npt.NDArray[np.bool_] | None = None,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]: ...
def identify_weak(
    motions: Motions,
    record: int,
    kinds: Sequence[str],
    *,
    delta: float,
    half_width: int | None = None,
    exponent: int | None = None,
    equations: int | None = None,
    average: bool = True,
    linear: bool = True,
    noise: tuple[float | None, float | None] = ...,
    lag: float | None = None,
    quantisation: float | None = None,
    mask: npt.NDArray[np.bool_] | None = None,
    step: int = 1,
    not_missing: Sequence[str] | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]: ...
def rolling_least_squares(
    regressors: npt.NDArray[np.number],
    sides: npt.NDArray[np.number],
    window: int,
    *,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.uint16],
]: ...
def status_flags() -> list[tuple[str, int]]: ...
def available_instructions() -> list[str]: ...
def instructions() -> str: ...
def force_instructions(name: str | None) -> None: ...
