from __future__ import annotations

import gc
import weakref
from collections.abc import Callable

import numpy as np
import pytest

import tvident


@pytest.mark.parametrize("name", ["fit_local_polynomials", "rolling_least_squares", "identify"])
def test_a_result_goes_when_it_is_let_go(name: str) -> None:
    y = np.random.default_rng(0).standard_normal(2000)
    calls: dict[str, Callable[[], object]] = {
        "fit_local_polynomials": lambda: tvident.fit_local_polynomials(y, 51),
        "rolling_least_squares": lambda: tvident.rolling_least_squares(y, y + 1, 51),
        "identify": lambda: tvident.identify(y, y + 1, sample_rate=1000),
    }
    gc.disable()
    try:
        result = calls[name]()
        if isinstance(result, tvident.Identification):
            assert len(result.columns()) > 0  # everything that is computed when asked for
        gone = weakref.ref(result)
        del result
        assert gone() is None
    finally:
        gc.enable()
