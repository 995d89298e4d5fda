# Records that go on.

from collections.abc import Mapping, Sequence
from typing import TypeAlias, final

import numpy as np
import numpy.typing as npt

from tvident._core_stubs.derivatives import LocalEstimates, LocalPolynomials
from tvident._core_stubs.regression import RollingRegressions

# What pickling a stream keeps: plain, so that it can be read wherever the stream goes on. The core alone looks into it.
_StreamState: TypeAlias = tuple[int, npt.NDArray[np.float64], int, bool]
_PolynomialState: TypeAlias = tuple[_StreamState, int, npt.NDArray[np.float64]]
_ParameterState: TypeAlias = tuple[list[int], list[npt.NDArray[np.float64]]]

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
class StreamedParameters:
    @property
    def first(self) -> int: ...
    @property
    def numbers(self) -> npt.NDArray[np.float64]: ...
    @property
    def status(self) -> npt.NDArray[np.uint16]: ...
    @property
    def order(self) -> npt.NDArray[np.uint8]: ...

@final
class PolynomialStream:
    def __new__(
        cls,
        plan: LocalPolynomials,
        *,
        step: int = 1,
        errors: bool = False,
        gaps: Mapping[str, object] | None = None,
        state: _PolynomialState | None = None,
    ) -> PolynomialStream: ...
    @property
    def delay(self) -> int: ...
    @property
    def samples(self) -> int: ...
    def state(self) -> _PolynomialState: ...
    def push(
        self, samples: npt.NDArray[np.number], weights: npt.NDArray[np.float64] | None = None
    ) -> StreamedEstimates: ...
    def finish(self) -> StreamedEstimates: ...

@final
class RollingStream:
    def __new__(
        cls,
        windows: Mapping[str, object],
        regressors: int,
        rhs_count: int,
        *,
        weighted: bool = False,
        lags: int | None = None,
        step: int = 1,
        state: _StreamState | None = None,
    ) -> RollingStream: ...
    @property
    def delay(self) -> int: ...
    @property
    def rows(self) -> int: ...
    def state(self) -> _StreamState: ...
    def push(
        self,
        regressors: npt.NDArray[np.number],
        rhs: npt.NDArray[np.number],
        weights: npt.NDArray[np.float64] | None = None,
    ) -> StreamedRegressions: ...
    def finish(self) -> StreamedRegressions: ...

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
        leaves_out: bool = False,
        weighted: bool = False,
        state: _ParameterState | None = None,
    ) -> ParameterStream: ...
    @property
    def delay(self) -> int: ...
    @property
    def samples(self) -> int: ...
    def state(self) -> _ParameterState: ...
    def hold(self, hold: bool) -> None: ...
    def reset(self) -> None: ...
    def push(
        self,
        angle: npt.NDArray[np.number],
        torque: npt.NDArray[np.number],
        weights: npt.NDArray[np.float64] | None = None,
    ) -> StreamedParameters: ...
    def finish(self) -> StreamedParameters: ...
