"""Results of a batch of records, put back into the batch's shape."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._status import Status

Array = npt.NDArray[np.float64]


class Collected:
    """Everything that was found, by name.

    Parameters
    ----------
    batch : tuple of int
        Shape of the batch; empty for a single record.
    names : sequence of str
        Unknowns in the order of the core.
    """

    def __init__(self, batch: tuple[int, ...], names: Sequence[str]) -> None:
        self._batch = batch
        self._names = list(names)
        self.values: dict[str, Array] = {}
        self.errors: dict[str, Array] = {}
        self.covariances: dict[frozenset[str], Array] = {}
        self.factors: dict[str, Array] = {}
        """What standard errors are still to be multiplied by, where that is left to those who ask for them."""
        self.constants: dict[str, tuple[Any, Any]] = {}
        self.jumps: list[list[int]] = [[]] * int(np.prod(batch, dtype=int))

    def _shaped(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return array.reshape(*self._batch, array.shape[-1])

    def windowed(self, core_plan: _core.LocalPolynomials, motions: _core.Motions, rows: int, **options: Any) -> None:
        """Identify everything in a window around every sample, in strong form."""
        pairs = list(combinations(range(sum(name in COEFFICIENTS for name in self._names)), 2))
        parameters, errors, covariances, deviation, condition, status, order, factors = _core.identify_windowed(
            core_plan, motions, rows, pairs, **options
        )
        for index, name in enumerate(self._names):
            self.values[name] = self._shaped(parameters[:, index])
            self.errors[name] = self._shaped(errors[:, index])
            self.factors[name] = factors[:, index].reshape(*self._batch, 1)
        for index, (one, other) in enumerate(pairs):
            pair = frozenset((self._names[one], self._names[other]))
            self.covariances[pair] = self._shaped(covariances[:, index])
        self.residual_std, self.condition = self._shaped(deviation), self._shaped(condition)
        self.status, self.order = self._shaped(status), self._shaped(order)

    def constant(self, core_plan: _core.LocalPolynomials, motions: _core.Motions, **options: Any) -> None:
        """Identify everything as constant over each record, in strong form."""
        values, covariance, deviation, condition, status, order = _core.identify_constant(core_plan, motions, **options)
        self.status, self.order = self._shaped(status), self._shaped(order)
        errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))

        def spread(array: Array) -> Array:
            """Repeat one value a record for every sample."""
            return np.broadcast_to(array.reshape(*self._batch, 1), self.status.shape)

        for index, name in enumerate(self._names):
            self.values[name], self.errors[name] = spread(values[:, index]), spread(errors[:, index])
            self._add_constant(name, values[:, index], errors[:, index])
        for one, other in combinations([name for name in self._names if name in COEFFICIENTS], 2):
            entry = covariance[:, self._names.index(one), self._names.index(other)]
            self.covariances[frozenset((one, other))] = spread(entry)
        self.residual_std, self.condition = spread(deviation), spread(condition)
        undetermined = np.isinf(self.condition)
        flags = np.uint16(Status.INVALID | Status.RANK_DEFICIENT)
        ill = ~undetermined & (self.condition > _core.HARDLY_TOLD_APART)
        self.status = np.where(undetermined, self.status | flags, self.status)
        self.status = np.where(ill, self.status | np.uint16(Status.ILL_CONDITIONED), self.status)

    def _add_constant(self, name: str, values: Array, errors: Array) -> None:
        value, error = values.reshape(self._batch), errors.reshape(self._batch)
        self.constants[name] = (value, error) if self._batch else (float(value), float(error))

    def records(self, found: Sequence[dict[str, Any]], numbers: Sequence[int]) -> None:
        """Add what the core found in every record on its own.

        Parameters
        ----------
        found : sequence of dict
            What the core returned, one a record.
        numbers : sequence of int
            What the core calls each unknown.
        """
        names = dict(zip(numbers, self._names, strict=True))
        count = found[0]["status"].size

        def every(arrays: list[npt.NDArray[Any]]) -> npt.NDArray[Any]:
            """Join one array a record, without a copy of a single one."""
            joined = np.stack(arrays) if len(arrays) > 1 else np.asarray(arrays[0])[np.newaxis]
            return self._shaped(joined)

        def gathered(name: str) -> npt.NDArray[Any]:
            return every([one[name] for one in found])

        self.jumps = [one.get("jumps", []) for one in found]
        self.residual_std, self.condition = gathered("deviations"), gathered("conditions")
        self.status = gathered("status")
        self.order = gathered("order") if "order" in found[0] else np.zeros(self.status.shape, np.uint8)
        for number, name in names.items():
            values, errors, alone = [], [], []
            for one in found:
                constants = {unknown: known for unknown, *known in one["constants"]}
                if number in constants:
                    value, error, _ = constants[number]
                    alone.append((value, error))
                    values.append(np.broadcast_to(np.float64(value), count))
                    errors.append(np.broadcast_to(np.float64(error), count))
                else:
                    row = one["changing"].index(number)
                    values.append(one["values"][row])
                    errors.append(one["errors"][row])
            self.values[name], self.errors[name] = every(values), every(errors)
            if len(alone) == len(found):
                # Where only some records say that it changes there is no one number for all.
                self._add_constant(name, *np.transpose(alone))
        coefficients = [number for number, name in names.items() if name in COEFFICIENTS]
        for first, second in combinations(coefficients, 2):
            pair = []
            for record in found:
                rows = [row for row, both in enumerate(record["pairs"]) if set(both) == {first, second}]
                constant = [value for *both, value in record.get("constant_pairs", ()) if set(both) == {first, second}]
                flat = np.broadcast_to(np.float64(constant[0] if constant else 0), count)
                pair.append(record["covariances"][rows[0]] if rows else flat)
            self.covariances[frozenset((names[first], names[second]))] = every(pair)

    def add_known(self, known: dict[str, float | npt.NDArray[np.number]], step: int) -> None:
        """Add what was known beforehand, without error."""
        for name, value in known.items():
            every = value if isinstance(value, float) else value[..., ::step]
            self.values[name] = np.broadcast_to(np.asarray(every, dtype=np.float64), self.status.shape)
            self.errors[name] = np.broadcast_to(np.float64(0), self.status.shape)
