from collections.abc import Callable, Mapping, Sequence
from typing import Literal, TypeAlias, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "CORRELATED_NOISE",
    "FEWEST_SAMPLES",
    "FEWEST_WIDTHS",
    "HARDLY_TOLD_APART",
    "LEAST_PLATEAU",
    "NOISE_MODEL_FAILS",
    "NO_CHANCE",
    "OTHER_CONSTANT",
    "WEAK_INSTRUMENT",
    "AutomaticEstimates",
    "ConstantsOfRows",
    "FactoredRows",
    "Identification",
    "IncompleteEstimates",
    "LocalEstimates",
    "LocalPolynomials",
    "MergedElement",
    "MergedIdentification",
    "Modes",
    "Motions",
    "Noise",
    "OutsideMask",
    "ParameterStream",
    "PassedNoise",
    "PolynomialStream",
    "Resampling",
    "Responses",
    "RollingRegressions",
    "RollingStream",
    "Scan",
    "StreamedEstimates",
    "StreamedParameters",
    "StreamedRegressions",
    "StrongForm",
    "Suspect",
    "Unknown",
    "WeakForm",
    "WindowEstimates",
    "WindowFit",
    "available_instructions",
    "built_in_terms",
    "estimate_automatically",
    "force_instructions",
    "fuse",
    "identify",
    "identify_merged",
    "instructions",
    "merged_rows",
    "modes",
    "noise",
    "noise_coherence",
    "parts_of_quantisation",
    "quantisation_step",
    "respond",
    "rolling_least_squares",
    "sliding_velocity",
    "spike_counts",
    "status_flags",
]

# What pickling a stream keeps: plain, so that it can be read wherever the stream goes on. The core alone looks into it.
_StreamState: TypeAlias = tuple[int, npt.NDArray[np.float64], int, bool]
_ParameterState: TypeAlias = tuple[list[int], list[npt.NDArray[np.float64]]]

CORRELATED_NOISE: float
FEWEST_SAMPLES: int
FEWEST_WIDTHS: int
HARDLY_TOLD_APART: float
LEAST_PLATEAU: float
NOISE_MODEL_FAILS: float
NO_CHANCE: float
OTHER_CONSTANT: float
WEAK_INSTRUMENT: float

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
        parts: Sequence[tuple[int, int]],
        least: int,
        *,
        weights: Sequence[float] | None = None,
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
class Motions:
    def __new__(
        cls,
        angle: npt.NDArray[np.number],
        torque: npt.NDArray[np.number],
        coefficients: list[npt.NDArray[np.number] | float | None],
        terms: list[npt.NDArray[np.number] | str],
        *,
        channels: Sequence[npt.NDArray[np.number] | None] = ...,
        noise: Sequence[tuple[float, int, Sequence[tuple[int, float]]]] | None = None,
        parts: Sequence[tuple[int, int]] | None = None,
        samples: int = 0,
        passed: tuple[PassedNoise | None, PassedNoise | None] = ...,
    ) -> Motions: ...

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
    def gain(self, *, workers: int | None = None) -> float: ...
    def passed_noise(self, *, workers: int | None = None) -> PassedNoise: ...

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
class WindowEstimates:
    @property
    def estimates(self) -> LocalEstimates: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...

@final
class ParameterStream:
    def __new__(
        cls,
        plan: LocalPolynomials,
        regression_window: int | None,
        known: Sequence[float | None],
        terms: Sequence[str],
        *,
        step: int = 1,
        factors: Sequence[float] | None = None,
        forgetting: float = 1.0,
        state: _ParameterState | None = None,
    ) -> ParameterStream: ...
    @property
    def delay(self) -> int: ...
    @property
    def samples(self) -> int: ...
    def state(self) -> _ParameterState: ...
    def hold(self, hold: bool) -> None: ...
    def reset(self) -> None: ...
    def push(self, angle: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> StreamedParameters: ...
    def finish(self) -> StreamedParameters: ...

@final
class StreamedParameters:
    @property
    def first(self) -> int: ...
    @property
    def values(self) -> npt.NDArray[np.float64]: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...
    @property
    def residual_std(self) -> npt.NDArray[np.float64]: ...
    @property
    def condition(self) -> npt.NDArray[np.float64]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def order(self) -> npt.NDArray[np.uint8]: ...

@final
class StreamedEstimates:
    @property
    def first(self) -> int: ...
    @property
    def estimates(self) -> LocalEstimates: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...

@final
class StreamedRegressions:
    @property
    def first(self) -> int: ...
    @property
    def regressions(self) -> RollingRegressions: ...

@final
class PolynomialStream:
    def __new__(
        cls,
        plan: LocalPolynomials,
        *,
        step: int = 1,
        errors: bool = False,
        state: _StreamState | None = None,
    ) -> PolynomialStream: ...
    @property
    def delay(self) -> int: ...
    @property
    def samples(self) -> int: ...
    def state(self) -> _StreamState: ...
    def push(self, samples: npt.NDArray[np.number]) -> StreamedEstimates: ...
    def finish(self) -> StreamedEstimates: ...

@final
class RollingStream:
    def __new__(
        cls,
        window: int,
        regressors: int,
        rhs_count: int,
        *,
        step: int = 1,
        state: _StreamState | None = None,
    ) -> RollingStream: ...
    @property
    def delay(self) -> int: ...
    @property
    def rows(self) -> int: ...
    def state(self) -> _StreamState: ...
    def push(self, regressors: npt.NDArray[np.number], rhs: npt.NDArray[np.number]) -> StreamedRegressions: ...
    def finish(self) -> StreamedRegressions: ...

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
    ) -> WindowFit: ...
    def estimate(
        self,
        samples: npt.NDArray[np.number],
        *,
        step: int = 1,
        workers: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> WindowEstimates: ...
    def scores(self, samples: npt.NDArray[np.number], sample: int) -> npt.NDArray[np.float64]: ...

@final
class Modes:
    @property
    def poles(self) -> npt.NDArray[np.complex128]: ...
    @property
    def shapes(self) -> npt.NDArray[np.complex128]: ...
    @property
    def lefts(self) -> npt.NDArray[np.complex128]: ...

@final
class Responses:
    @property
    def angle(self) -> npt.NDArray[np.float64]: ...
    @property
    def velocity(self) -> npt.NDArray[np.float64]: ...
    @property
    def lost(self) -> list[int | None]: ...

@final
class RollingRegressions:
    @property
    def params(self) -> npt.NDArray[np.float64]: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...
    @property
    def rss(self) -> npt.NDArray[np.float64]: ...
    @property
    def residuals(self) -> npt.NDArray[np.float64]: ...
    @property
    def rsquared(self) -> npt.NDArray[np.float64]: ...
    @property
    def condition(self) -> npt.NDArray[np.float64]: ...
    @property
    def lags(self) -> int: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...

@final
class Noise:
    @property
    def sigma(self) -> float: ...
    @property
    def quantisation(self) -> float: ...

@final
class WeakForm:
    def __new__(
        cls,
        window_length: Sequence[int | None],
        exponent: Sequence[int | None],
        regression_window: Sequence[int | None],
        *,
        averaging: bool = True,
        linear: bool = True,
        noise: tuple[float | None, float | None] = ...,
        shown_noise: Sequence[float] | None = None,
    ) -> WeakForm: ...

@final
class StrongForm:
    def __new__(
        cls, plan: LocalPolynomials, regression_window: int, *, filter_torque: bool = False, linear: bool = False
    ) -> StrongForm: ...
    def around(self, first: int, end: int, samples: int) -> tuple[int, int]: ...
    def parts_of_scatter(self, samples: int) -> list[tuple[int, int]]: ...
    def scatter(self, motions: Motions, *, workers: int | None = None) -> list[list[float]]: ...
    def scan(
        self,
        motions: Motions,
        kinds: Sequence[str],
        *,
        lag: Sequence[float],
        masks: Sequence[npt.NDArray[np.bool_]] | None = None,
        weights: npt.NDArray[np.float64] | None = None,
        workers: int | None = None,
    ) -> list[Scan]: ...
    def rows(self, motions: Motions, wanted: tuple[int, int], *, workers: int | None = None) -> FactoredRows: ...
    def constants(
        self, motions: Motions, rows: FactoredRows, *, workers: int | None = None
    ) -> ConstantsOfRows | None: ...

@final
class FactoredRows:
    def __new__(cls, factor: list[float], columns: int, rows: int) -> FactoredRows: ...
    def __getnewargs__(self) -> tuple[list[float], int, int]: ...
    @property
    def factor(self) -> list[float]: ...
    @property
    def columns(self) -> int: ...
    @property
    def rows(self) -> int: ...

@final
class ConstantsOfRows:
    @property
    def values(self) -> list[float]: ...
    @property
    def covariance(self) -> list[float]: ...
    @property
    def residual(self) -> float: ...
    @property
    def condition(self) -> float: ...

@final
class Unknown:
    @property
    def kind(self) -> Literal["windowed", "constant", "varying"]: ...
    @property
    def values(self) -> npt.NDArray[np.float64]: ...
    @property
    def stderr(self) -> npt.NDArray[np.float64]: ...
    @property
    def factor(self) -> float: ...
    @property
    def test(self) -> tuple[float, float] | None: ...
    @property
    def untested(self) -> bool: ...

@final
class Suspect:
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> float: ...
    @property
    def stderr(self) -> float: ...
    @property
    def conspicuous(self) -> bool: ...

@final
class Scan:
    @property
    def unknowns(self) -> list[int]: ...
    @property
    def window_length(self) -> list[int]: ...
    @property
    def band(self) -> list[float]: ...
    @property
    def values(self) -> list[list[float]]: ...
    @property
    def stderr(self) -> list[list[float]]: ...
    @property
    def corrected(self) -> bool: ...
    @property
    def plateau(self) -> tuple[int, int] | None: ...
    @property
    def moved(self) -> bool: ...
    @property
    def tried(self) -> int: ...

@final
class OutsideMask:
    @property
    def differing(self) -> list[tuple[int, float, float]]: ...
    @property
    def residual_ratio(self) -> float | None: ...

@final
class Identification:
    @property
    def window_length(self) -> int: ...
    @property
    def exponent(self) -> int | None: ...
    @property
    def regression_window(self) -> int: ...
    @property
    def unknowns(self) -> list[Unknown]: ...
    @property
    def covariances(self) -> dict[tuple[int, int], npt.NDArray[np.float64]]: ...
    @property
    def condition(self) -> npt.NDArray[np.float64]: ...
    @property
    def residual_std(self) -> npt.NDArray[np.float64]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def record_status(self) -> int: ...
    @property
    def order(self) -> npt.NDArray[np.uint8]: ...
    @property
    def jumps(self) -> list[int]: ...
    @property
    def noise(self) -> tuple[float, float] | None: ...
    @property
    def shown_noise(self) -> float | None: ...
    @property
    def lengths(self) -> list[tuple[int, float]]: ...
    @property
    def prediction_error(self) -> float: ...
    @property
    def weighted(self) -> bool: ...
    @property
    def pooling(self) -> float | None: ...
    @property
    def constants_condition(self) -> float: ...
    @property
    def weakest(self) -> list[float]: ...
    @property
    def mostly_noise(self) -> bool: ...
    @property
    def unexplained(self) -> bool: ...
    @property
    def lag(self) -> tuple[float, float] | None: ...
    @property
    def angle_zero(self) -> tuple[float, float] | None: ...
    @property
    def free_offset(self) -> tuple[float, float] | None: ...
    @property
    def suspects(self) -> list[Suspect]: ...
    @property
    def defects(self) -> list[tuple[int, str, float]]: ...
    @property
    def resting(self) -> float: ...
    @property
    def pulses(self) -> list[tuple[int, int]]: ...
    @property
    def spikes(self) -> list[tuple[int, int, float]]: ...
    @property
    def lost(self) -> list[int]: ...
    @property
    def limits(self) -> list[float] | None: ...
    @property
    def unread(self) -> list[list[int]]: ...
    @property
    def scan(self) -> Scan | None: ...
    @property
    def outside_mask(self) -> OutsideMask | None: ...
    @property
    def instrument(self) -> tuple[float, float] | None: ...

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
def noise(
    samples: npt.NDArray[np.number], quantisation: float | None = None, passed: PassedNoise | None = None
) -> list[Noise]: ...
def noise_coherence(
    angle: npt.NDArray[np.number], torque: npt.NDArray[np.number], variances: list[float]
) -> list[float | None]: ...
def fuse(
    record: npt.NDArray[np.number],
    others: Sequence[tuple[int, float, npt.NDArray[np.number]]],
    delta: float,
) -> npt.NDArray[np.float64]: ...
def spike_counts(angle: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> list[list[int]]: ...
def parts_of_quantisation(samples: int) -> list[tuple[int, int]]: ...
def merged_rows(one: FactoredRows, other: FactoredRows) -> FactoredRows: ...
def quantisation_step(
    samples: npt.NDArray[np.number], *, parts: Sequence[tuple[int, int]] | None = None, of: int = 0
) -> float: ...
def identify(
    motions: Motions,
    kinds: Sequence[str],
    method: WeakForm | StrongForm,
    *,
    delta: float,
    lag: Sequence[float | None],
    angle_zero: Sequence[float | None] | None = None,
    quantisation: float | None = None,
    masks: Sequence[npt.NDArray[np.bool_]] | None = None,
    weights: npt.NDArray[np.float64] | None = None,
    propagate: bool = False,
    step: int = 1,
    wanted: tuple[int, int] | None = None,
    diagnose: bool = True,
    instrument: npt.NDArray[np.number] | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[Identification]: ...

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
    def test(self) -> tuple[float, float] | None: ...
    @property
    def spread(self) -> list[tuple[float, float]]: ...

@final
class MergedIdentification:
    @property
    def window_length(self) -> int: ...
    @property
    def exponent(self) -> int: ...
    @property
    def regression_window(self) -> int: ...
    @property
    def lengths(self) -> list[tuple[int, float]]: ...
    @property
    def prediction_error(self) -> float: ...
    @property
    def noise(self) -> tuple[list[float], list[float]]: ...
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
def built_in_terms() -> list[str]: ...
def modes(
    inertia: npt.NDArray[np.float64],
    damping: npt.NDArray[np.float64],
    stiffness: npt.NDArray[np.float64],
    workers: int | None = None,
) -> Modes: ...
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
def rolling_least_squares(
    regressors: npt.NDArray[np.number],
    rhs: npt.NDArray[np.number],
    windows: Mapping[str, object],
    *,
    weights: npt.NDArray[np.float64] | None = None,
    constant: int | None = None,
    correlated: bool = False,
    lags: int | None = None,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> RollingRegressions: ...
def sliding_velocity(
    angle: npt.NDArray[np.number], delta: float, *, workers: int | None = None
) -> npt.NDArray[np.float64]: ...
def status_flags() -> list[tuple[str, int]]: ...
def available_instructions() -> list[str]: ...
def instructions() -> str: ...
def force_instructions(name: str | None) -> None: ...
