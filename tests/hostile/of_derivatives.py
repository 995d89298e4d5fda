"""Random calls that differentiate and filter."""

from __future__ import annotations

from typing import Any

import numpy as np

import tvident
from hostile import arguments, arrays, invariants


def fit(generator: np.random.Generator) -> None:
    """Fit local polynomials; again with other workers, and to a plain copy."""
    shape = arrays.shape(generator)
    samples, _ = arrays.dressed(generator, arrays.values(generator, shape))
    count = shape[-1] if shape else 1
    length = arguments.one(generator, "auto", *(arguments.window(generator, count) for _ in range(3)))
    options = arguments.some(
        generator,
        {
            "delta": lambda: arguments.one(generator, 0.01),
            "max_order": lambda: arguments.one(generator, int(generator.integers(0, 17))),
            "order": lambda: arguments.one(generator, int(generator.integers(0, 17))),
            "criterion": lambda: arguments.one(generator, "aicc", "aicc-textbook", "aic", "bic"),
            "selection": lambda: arguments.one(generator, "window", "pooled", "average"),
            "max_deriv": lambda: arguments.one(generator, int(generator.integers(0, 17))),
            "axis": lambda: arguments.one(generator, -1, 0, 1, 2),
            "step": lambda: arguments.one(generator, 1, 2, 7, 5000, 2**62),
            "nan_policy": lambda: arguments.one(generator, "propagate", "raise"),
            "quantisation": lambda: arguments.one(generator, 0.0, 0.01, 1e-300, 1e60),
            "workers": lambda: arguments.one(generator, 1, 2, 64),
            "t": lambda: np.arange(count) * 0.01 + generator.choice([0, 1e9, np.nan]),
        },
    )

    def found(y: Any, **changed: Any) -> dict[str, Any]:
        result = tvident.fit_local_polynomials(y, length, **(options | changed))
        everything = {
            "derivatives": result.derivatives,
            "stderr": result.stderr,
            "status": result.status,
            "order": result.order,
            "sigma": result.sigma,
            "window": result.window_length,
            "settings": result.settings,
            "scores": result.scores(count // 2),
        }
        repr(result)
        return everything

    first = found(samples)
    numbered = {str(place): one for place, one in enumerate(first["derivatives"])}
    # A polynomial through all samples of a window leaves nothing that noise could be estimated from.
    through_all = np.isnan(first["sigma"])
    errors = {str(place): np.where(through_all, 0.0, one) for place, one in enumerate(first["stderr"])}
    # Where windows are chosen every derivative has its own.
    apart = numbered.keys() if length == "auto" else ()
    invariants.check(numbered, errors, first["status"], apart)
    assert invariants.same(first, found(samples, workers=3)), "other workers give other numbers"
    copy = arrays.plain(samples)
    # The step of doubles may be found where floats of fewer digits hide it, and the other way round.
    if copy is not None and options.get("quantisation") is not None:
        assert invariants.same(first, found(copy)), "another layout gives other numbers"


def savitzky_golay(generator: np.random.Generator) -> None:
    """Filter; again, and a plain copy."""
    shape = arrays.shape(generator)
    samples, _ = arrays.dressed(generator, arrays.values(generator, shape))
    length = arguments.one(generator, arguments.window(generator, shape[-1] if shape else 1))
    order = arguments.one(generator, 0, 1, 2, 3, 4, 7, 15, "aicc")
    options = arguments.some(
        generator,
        {
            "deriv": lambda: arguments.one(generator, 0, 1, 2, 5, 10**9),
            "delta": lambda: arguments.one(generator, 0.1),
            "axis": lambda: arguments.one(generator, -1, 0, 1),
            "mode": lambda: arguments.one(generator, "interp", "mirror", "constant", "nearest", "wrap"),
            "cval": lambda: arguments.one(generator, 1.0),
        },
        share=0.3,
    )
    first = tvident.savgol_filter(samples, length, order, **options)
    assert not np.isinf(first).any(), "a filtered sample is infinite"
    assert invariants.same(first, tvident.savgol_filter(samples, length, order, **options))
    copy = arrays.plain(samples)
    if copy is not None and first.dtype == copy.dtype:
        assert invariants.same(first, tvident.savgol_filter(copy, length, order, **options))
