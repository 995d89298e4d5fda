# Least squares in windows of rows.

from collections.abc import Callable, Mapping
from typing import final

import numpy as np
import numpy.typing as npt

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

def rows_within(
    times: npt.NDArray[np.float64], begins: npt.NDArray[np.float64], duration: float
) -> tuple[npt.NDArray[np.uintp], npt.NDArray[np.uintp]]: ...
def rolling_least_squares(
    regressors: npt.NDArray[np.number],
    rhs: npt.NDArray[np.number],
    windows: Mapping[str, object],
    *,
    weights: npt.NDArray[np.float64] | None = None,
    constant: int | None = None,
    correlated: bool = False,
    lags: int | None = None,
    spans: tuple[npt.NDArray[np.uintp], npt.NDArray[np.uintp]] | None = None,
    step: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> RollingRegressions: ...
