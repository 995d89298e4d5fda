"""What is identified in dask arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from tvident._equation import COEFFICIENTS


@dataclass(frozen=True)
class DaskIdentification:
    r"""Parameters as dask arrays; nothing is computed before it is asked for.

    Attributes
    ----------
    time : dask.array.Array, shape (n,)
    inertia, damping, stiffness : dask.array.Array, shape (\*, n)
    terms, stderr : dict of str to dask.array.Array
        Factors of further terms, and standard errors of all parameters.
    condition, residual_std, order, status : dask.array.Array, shape (\*, n)
        As in :class:`tvident.Identification`.
    constants : dict of str to (value, stderr)
        What is constant over a record: numbers, or arrays in the shape of the batch. Asking computes them.
    record_status : int, or ndarray of uint16 in the shape of the batch
        Flags of whole records. Asking computes them.
    advice : tuple of str
        What is worth doing, of stretches that choices were made from, and in strong form what the weak form finds elsewhere in stretches.
        Asking computes it.
    settings : dict
        What was given and chosen, as those of a result: ``settings=`` of another call repeats it. Asking computes what the record says.
    units : dict of str to str

    See Also
    --------
    tvident.dask.identify : returns it.
    tvident.Identification : the same of arrays in memory, which says more.

    References
    ----------
    M. Rocklin: Dask: parallel computation with blocked algorithms and task scheduling, Proceedings of the 14th Python in Science Conference
    (2015).
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import dask.array as da
    >>> import tvident
    >>> import tvident.dask
    >>> rig = tvident.simulate_torsional_rig(duration=20.0)
    >>> angle, torque = (da.from_array(one, chunks=6000) for one in (rig.angle, rig.torque))
    >>> result = tvident.dask.identify(angle, torque, sample_rate=1000, method="paper", step=100)
    >>> result.stiffness.shape
    (200,)
    """

    time: Any
    columns: Mapping[str, Any] = field(repr=False)
    chosen: Any = field(repr=False)
    units: Mapping[str, str]
    told: Any = field(repr=False)
    _saying: Any = field(default=None, repr=False)

    def __repr__(self) -> str:
        *batch, samples = self.inertia.shape
        count = math.prod(batch)
        records = f"{count} record{'' if count == 1 else 's'}"
        return f"<DaskIdentification of {records} of {samples} samples, in dask arrays that are not computed yet>"

    @cached_property
    def settings(self) -> dict[str, Any]:
        """What was given and chosen, as plain JSON; asking computes it.

        See Also
        --------
        tvident.dask.identify : `settings=` repeats it.
        """
        return dict(self.chosen.compute())

    @property
    def inertia(self) -> Any:
        r"""Inertia, dask array of float64, shape (\*, n), in kg m².

        See Also
        --------
        stderr : its error.
        tvident.Identification : the same in memory.
        """
        return self.columns["inertia"]

    @property
    def damping(self) -> Any:
        r"""Damping, dask array of float64, shape (\*, n), in N m s/rad.

        See Also
        --------
        stderr : its error.
        tvident.Identification : the same in memory.
        """
        return self.columns["damping"]

    @property
    def stiffness(self) -> Any:
        r"""Stiffness, dask array of float64, shape (\*, n), in N m/rad.

        See Also
        --------
        stderr : its error.
        tvident.Identification : the same in memory.
        """
        return self.columns["stiffness"]

    @property
    def terms(self) -> dict[str, Any]:
        r"""Factors of further terms by name, dask arrays of float64, shape (\*, n).

        See Also
        --------
        stderr : their errors.
        """
        return {name: self.columns[name] for name in self._names if name not in COEFFICIENTS}

    @property
    def stderr(self) -> dict[str, Any]:
        r"""Standard errors by name, dask arrays of float64, shape (\*, n), in the parameters' units.

        See Also
        --------
        tvident.Identification : says what they contain.
        """
        return {name: self.columns[f"{name}_stderr"] for name in self._names}

    @property
    def condition(self) -> Any:
        r"""Condition numbers of the equations, dask array of float64, shape (\*, n).

        See Also
        --------
        tvident.Identification : the same in memory.
        """
        return self.columns["condition"]

    @property
    def residual_std(self) -> Any:
        r"""Standard deviation of the residuals of the torque in N m, dask array of float64, shape (\*, n).

        See Also
        --------
        tvident.Identification : the same in memory.
        """
        return self.columns["residual_std"]

    @property
    def order(self) -> Any:
        r"""Orders of the polynomials, dask array of uint8, shape (\*, n).

        See Also
        --------
        tvident.fit_local_polynomials : says how they are chosen.
        """
        return self.columns["order"]

    @property
    def status(self) -> Any:
        r"""Flags of samples, dask array of uint16, shape (\*, n).

        See Also
        --------
        record_status : flags of the record.
        tvident.Status : what flags mean.
        """
        return self.columns["status"]

    @property
    def constants(self) -> dict[str, tuple[Any, Any]]:
        """What is constant over a record, by name: value and standard error. Asking computes them.

        See Also
        --------
        tvident.Identification : the same in memory.
        """
        return dict(self._computed[0])

    @property
    def record_status(self) -> Any:
        """Flags of the whole record, int or ndarray of uint16 in the shape of the batch. Asking computes them.

        See Also
        --------
        status : flags of samples.
        tvident.Status : what flags mean.
        """
        return self._computed[1]

    @cached_property
    def advice(self) -> tuple[str, ...]:
        """What is worth doing; in strong form first what the weak form finds elsewhere in stretches. Asking computes it.

        See Also
        --------
        record_status : flags of the record.
        tvident.Identification : says more.
        """
        return tuple(self._saying.compute()) if self._saying is not None else ()

    @property
    def _names(self) -> list[str]:
        return [name.removesuffix("_stderr") for name in self.columns if name.endswith("_stderr")]

    @cached_property
    def _computed(self) -> tuple[dict[str, tuple[Any, Any]], Any]:
        constants, status = self.told.compute()
        return constants, status
