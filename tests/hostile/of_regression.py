"""Random calls of rolling least squares."""

from __future__ import annotations

from typing import Any

import numpy as np

import tvident
from hostile import arguments, arrays, invariants


def rolling(generator: np.random.Generator) -> None:
    """Solve; again with other workers, and with plain copies."""
    rows = int(generator.choice(arrays.LENGTHS))
    columns = int(generator.choice([0, 1, 1, 2, 3, 5, 16, 17]))
    sides = (rows,) if generator.random() < 0.5 else (rows, int(generator.choice([0, 1, 2, 5])))
    regressors, _ = arrays.dressed(generator, _some_dependent(generator, arrays.values(generator, (rows, columns))))
    rhs, _ = arrays.dressed(
        generator, arrays.values(generator, sides if generator.random() < 0.9 else arrays.shape(generator))
    )
    length = arguments.one(generator, arguments.window(generator, rows))
    options = arguments.some(
        generator,
        {
            "step": lambda: arguments.one(generator, 1, 2, 9, 10_000),
            "workers": lambda: arguments.one(generator, 1, 2, 64),
        },
    )

    def found(a: Any, b: Any, **changed: Any) -> dict[str, Any]:
        return dict(vars(tvident.rolling_least_squares(a, b, length, **(options | changed))))

    first = found(regressors, rhs)
    params, stderr = np.moveaxis(first["params"], 0, -1), np.moveaxis(first["stderr"], 0, -1)
    names = list(np.ndindex(params.shape[:-1]))
    invariants.check(
        {str(index): params[index] for index in names}, {str(index): stderr[index] for index in names}, first["status"]
    )
    assert not (first["rss"] < 0).any(), "a sum of squares is negative"
    assert invariants.same(first, found(regressors, rhs, workers=3)), "other workers give other numbers"
    copies = arrays.plain(regressors), arrays.plain(rhs)
    if copies[0] is not None and copies[1] is not None:
        assert invariants.same(first, found(*copies)), "another layout gives other numbers"


def _some_dependent(generator: np.random.Generator, regressors: arrays.Array) -> arrays.Array:
    if regressors.shape[1] > 1 and generator.random() < 0.2:
        regressors[:, 1] = regressors[:, 0]
    return regressors
