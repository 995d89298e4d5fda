"""One number for each parameter of a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._results.estimates import Estimates
from tvident._results.measured import Measured, known_name, number_of
from tvident._tables import Tabular


class Valued(Tabular):
    """What has a number for each parameter."""

    inertia: npt.NDArray[np.float64]
    time: npt.NDArray[np.float64]
    settings: dict[str, Any]
    units: Mapping[str, str]
    _found: Estimates

    @property
    def _unflagged(self) -> npt.NDArray[np.bool_]:
        raise NotImplementedError

    def _numbers(self) -> dict[str, npt.NDArray[np.float64]]:
        """Return all parameters, each followed by its standard errors."""
        raise NotImplementedError

    def value(self, name: str, record: int | None = None) -> Measured:
        """Return one number for a parameter, with its error, whatever its kind.

        Parameters
        ----------
        name : str
            ``"inertia"``, ``"damping"``, ``"stiffness"``, a term, ``"natural_frequency"`` or ``"damping_ratio"``.
        record : int, optional
            Which record of a batch, counted along its flattened axes.

        Returns
        -------
        Measured
            ``value`` and ``stderr`` first: those of a constant; of a parameter that changes the medians over samples whose flags let
            trust them, with ``least`` and ``greatest`` for nine tenths of them. ``str()`` of it has even digits and the unit.

        Raises
        ------
        KeyError
            If there is no such parameter.
        ValueError
            If there are several records and none is named.

        See Also
        --------
        constants, stderr : all numbers, and all errors.
        summary : a table of them.

        References
        ----------
        Medians and ranges are those of samples that flags let trust, whatever the verdict says of the record; the errors are explained in
        docs/automatic.md, "Errors".

        Examples
        --------
        >>> import tvident
        >>> rig = tvident.simulate_torsional_rig(duration=3.0)
        >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate)
        >>> value, error, *_ = result.value("inertia")
        >>> print(f"{value:.4f}")
        0.0123
        """
        if self.inertia.ndim > 1 and record is None:
            raise ValueError(f"a value is of one record; got {self._records} of them; give record=0, say")
        if record is not None and not -self._records <= arguments.whole_number("record", record) < self._records:
            raise ValueError(f"record must be less than the {self._records} records; got {record}; count from 0")
        values = self._values(record or 0)
        return values[known_name(name, values)]

    @property
    def _records(self) -> int:
        return int(np.prod(self.inertia.shape[:-1], dtype=int))

    def _values(self, record: int = 0) -> Mapping[str, Measured]:
        """Return one number for everything that has a unit, in one record."""
        numbers, good = self._numbers(), self._unflagged.reshape(-1, self.time.size)[record]
        kinds = self.settings["kinds"]
        kinds = kinds | {name: str(kind.reshape(-1)[record]) for name, kind in self._found.kinds.items()}
        changing = [
            kinds[name] for name in ("inertia", "stiffness") if kinds[name] in {"windowed", "varying", "expanded"}
        ]
        kinds |= dict.fromkeys(("natural_frequency", "damping_ratio"), changing[0] if changing else "constant")
        each = {name: values.reshape(-1, self.time.size)[record] for name, values in numbers.items()}
        return {
            name: number_of(each[name], each[f"{name}_stderr"], kinds[name], self.units.get(name, ""), good)
            for name in each
            if f"{name}_stderr" in each
        }
