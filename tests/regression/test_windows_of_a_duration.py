"""Windows of a duration on irregular times: what times say of their unit and of missing ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident._units import UnitError

Array = npt.NDArray[np.float64]


@pytest.fixture
def rows() -> tuple[Array, Array, Array]:
    """Give regressors, right-hand sides and irregular times in seconds."""
    generator = np.random.default_rng(6)
    A, b = generator.standard_normal((400, 2)), generator.standard_normal(400)
    return A, b, np.cumsum(generator.exponential(0.01, 400))


class WithUnit(np.ndarray[Any, Any]):
    """An array that says its unit by an attribute, as those of other packages do."""

    units = "ms"


def test_times_say_their_unit(rows: tuple[Array, Array, Array]) -> None:
    A, b, t = rows
    expected = tvident.rolling_least_squares(A, b, "500ms", t=t)
    for given in (tvident.Channel(1e3 * t, "ms"), (1e3 * t).view(WithUnit), tvident.Channel(t, "s")):
        found = tvident.rolling_least_squares(A, b, "500ms", t=given)
        np.testing.assert_allclose(found.params, expected.params, rtol=1e-9)
        assert np.array_equal(found.status, expected.status)
    with pytest.raises(UnitError, match="the time must be in a unit that can be converted to s; got 'V'"):
        tvident.rolling_least_squares(A, b, "500ms", t=tvident.Channel(t, "V"))


def test_masked_times_are_missing(rows: tuple[Array, Array, Array]) -> None:
    A, b, t = rows
    masked = np.ma.masked_array(t, mask=np.arange(400) == 50)
    with pytest.raises(ValueError, match=r"t must hold finite times; t\[50\] is nan"):
        tvident.rolling_least_squares(A, b, "500ms", t=masked)
    found = tvident.rolling_least_squares(A, b, "500ms", t=np.ma.masked_array(t))
    assert np.array_equal(found.params, tvident.rolling_least_squares(A, b, "500ms", t=t).params)
