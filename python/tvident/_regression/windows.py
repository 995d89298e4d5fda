"""What windows of rows are like: how long, where their row is in them, what counts in them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Alignment: TypeAlias = Literal["centre", "trailing", "leading"]


@dataclass(frozen=True)
class AskedWindows:
    """What a call says of windows."""

    window_length: int | str
    alignment: str
    half_life: float | str | None
    min_observations: int | None
    t: npt.ArrayLike | None
    delta: float | None = None
    sample_rate: float | None = None

    def period(self, rows: int) -> float | None:
        """Return the seconds from row to row; None where nobody said."""
        times = {"delta": self.delta, "sample_rate": self.sample_rate, "t": self.t}
        if all(one is None for one in times.values()):
            return None
        try:
            return arguments.sample_period(rows, delta=self.delta, sample_rate=self.sample_rate, t=self.t)
        except arguments.NotUniformError as error:
            if isinstance(self.window_length, str):
                raise
            rule = str(error).rpartition("; ")[0]
            raise ValueError(
                f"{rule}; give window_length as a duration, such as '0.2 s', or leave out t: windows of {self.window_length} rows need none"
            ) from None


@dataclass(frozen=True)
class RegressionWindows:
    """What windows are like."""

    rows: int
    alignment: str
    at_least: int | None
    half_life: float | None

    @property
    def after(self) -> int:
        """Rows of a window after the row that it belongs to."""
        return {"centre": self.rows - 1 - self.rows // 2, "trailing": 0, "leading": self.rows - 1}[self.alignment]

    def around_rows(self) -> RegressionWindows:
        """Return windows of the same length around every row, in which all rows count the same."""
        return replace(self, alignment="centre", half_life=None)

    def told(self) -> dict[str, object]:
        """Return them as the core takes them."""
        return {
            "rows": self.rows,
            "alignment": self.alignment,
            "at_least": self.at_least,
            "half_life": self.half_life,
        }


def windows_given(asked: AskedWindows, rows: int, regressors: int) -> RegressionWindows:
    """Return the windows that were asked for, for a record of so many rows."""
    period = asked.period(rows)
    for name, value in (("window_length", asked.window_length), ("half_life", asked.half_life)):
        if isinstance(value, str) and period is None:
            arguments.seconds(name, value)
            raise ValueError(
                f"{name} must be a number of rows where no time is given; got {value!r}; "
                "give sample_rate, delta or t, or the number of rows"
            )
    length = arguments.window_length("window_length", asked.window_length, period or 1.0, odd=False)
    arguments.check_window("window_length", length, rows, least=regressors + 1)
    alignment = arguments.one_of("alignment", asked.alignment, get_args(Alignment))
    at_least = least_given(asked.min_observations, length, regressors)
    fading = half_life_given(asked.half_life, period or 1.0, alignment, length, regressors)
    return RegressionWindows(length, alignment, at_least, fading)


def least_given(min_observations: int | None, length: int, regressors: int) -> int | None:
    """Return how many rows windows of a length must hold; None where nothing was said."""
    if min_observations is None:
        return None
    at_least = arguments.whole_number("min_observations", min_observations)
    if not regressors < at_least <= length:
        raise ValueError(
            f"min_observations must be more than the {regressors} regressors and at most the window's {length} rows; got {at_least}; "
            f"use {regressors + 1} to {length}"
        )
    return at_least


def half_life_given(
    value: float | str | None, period: float, alignment: str, length: int, regressors: int
) -> float | None:
    """Return a half-life in rows, which are so many seconds apart; None where nothing was said."""
    if value is None:
        return None
    rows = arguments.seconds("half_life", value) / period if isinstance(value, str) else value
    half_life = arguments.positive_number("half_life", rows)
    if alignment == "centre":
        raise ValueError(
            f"half_life must go with alignment='trailing' or 'leading'; got {value} with 'centre'; give one of these, or no half_life"
        )
    with np.errstate(under="ignore"):  # where a caller had underflows raised
        left = 2.0 ** (-np.arange(length) / half_life)
    count = float(left.sum() ** 2 / (left @ left))
    if count <= regressors:
        raise ValueError(
            f"half_life must leave the weight of more rows than the {regressors} regressors; got {value}, which leaves that of "
            f"{count:.3g} rows; use {regressors / 2 + 1:g} rows or more"
        )
    return half_life


def unit_of_weights(weights: npt.NDArray[np.float64]) -> float:
    """Return a power of four near weights: over it they lose no digit, nor do their roots, whichever of some weights it is near."""
    largest = float(weights.max(initial=0.0))
    return 4.0 ** ((math.frexp(largest)[1] - 1) // 2) if largest > 0 else 1.0


def lags_given(lags: int | None, windows: RegressionWindows, *, is_correlated: bool, is_robust: bool) -> int | None:
    """Return over how many rows residuals are correlated, as it was given; check what goes together."""
    if windows.half_life is not None and (is_correlated or is_robust):
        other = "covariance='hac'" if is_correlated else "loss='huber'"
        raise ValueError(
            f"half_life must go with covariance='classic' and loss='squares'; got {windows.half_life:g} rows with {other}; "
            "leave out one of them"
        )
    if is_correlated and is_robust:
        raise ValueError("covariance='hac' must go with loss='squares'; got 'huber'; leave out one of them")
    if lags is None:
        return None
    if not is_correlated:
        raise ValueError(
            f"lags must go with covariance='hac'; got {arguments.shown(lags)} with 'classic'; give that, or no lags"
        )
    count = arguments.whole_number("lags", lags, least=0)
    if 2 * (count + 1) > windows.rows:
        most = windows.rows // 2 - 1
        raise ValueError(
            f"lags must be less than half of the window's {windows.rows} rows; got {count}; use {most} or less, or a longer window"
        )
    return count
