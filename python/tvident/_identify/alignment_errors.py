"""What is not known of the alignment of two clocks, in the errors of what was identified with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._results import Estimates

Numbers = npt.NDArray[np.float64]


def with_errors_of_alignment(found: Estimates, as_aligned: Estimates, moved: Sequence[Estimates]) -> Estimates:
    """Return estimates whose errors contain those of the alignment.

    The alignment is estimated from the same equations. The errors of least squares with one more unknown are those without it, and what
    the unknown's own error moves, added as squares.

    Parameters
    ----------
    found : Estimates
    as_aligned : Estimates
        With the same choices, which `moved` is compared with.
    moved : sequence of Estimates
        Likewise where clocks are aligned as one of the independent errors of their alignment has it, by one standard error.
    """
    changes = [_changes(as_aligned, one) for one in moved]

    def added(one: str, other: str) -> Any:
        factors = found.factors.get(one, 1.0) * found.factors.get(other, 1.0)
        return sum(change[one] * change[other] for change in changes) / factors

    errors = {name: np.sqrt(error**2 + added(name, name)) for name, error in found.errors.items()}
    covariances = {
        pair: values + added(*(tuple(pair) if len(pair) > 1 else 2 * tuple(pair)))
        for pair, values in found.covariances.items()
    }
    constants = dict(found.constants)
    for name, (value, error) in found.constants.items():
        if all(name in one.constants for one in moved):
            away = [np.subtract(one.constants[name][0], as_aligned.constants[name][0]) for one in moved]
            constants[name] = value, float(np.sqrt(error**2 + np.sum(np.square(np.nan_to_num(away)))))
    # What the alignment moves it moves at all samples.
    return replace(found, errors=errors, covariances=covariances, constants=constants, in_common={})


def _changes(as_aligned: Estimates, moved: Estimates) -> Mapping[str, Numbers]:
    """Return by how much values changed; zero where there is none."""
    return {name: np.nan_to_num(values - as_aligned.values[name]) for name, values in moved.values.items()}
