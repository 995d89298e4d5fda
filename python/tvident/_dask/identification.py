"""Identification of dask arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvident import _arguments as arguments
from tvident._dask.blocks import imported, samples_of, stacked, weights_of
from tvident._dask.found import DaskIdentification
from tvident._dask.records import record_of
from tvident._equation import LINEAR_UNITS, UNITS, GivenTerm
from tvident._identify import Method
from tvident._pieces import Given
from tvident._units import ROTARY, axis_of


# All but the data are options, as users call it.
def identify(
    angle: Any,
    torque: Any,
    *,
    sample_rate: float | None = None,
    delta: float | None = None,
    angle_unit: str | None = None,
    torque_unit: str | None = None,
    method: Method = "auto",
    inertia: str | float | None = None,
    damping: str | float | None = None,
    stiffness: str | float | None = None,
    terms: Sequence[GivenTerm] | None = None,
    lag: float | str | None = None,
    quantisation: float | None = None,
    weights: Any = None,
    nan_policy: arguments.RowPolicy = "omit",
    step: int = 1,
    settings: Mapping[str, Any] | None = None,
) -> DaskIdentification:
    r"""Identify I(t), C(t) and K(t) from an angle and a torque in dask arrays, on as many machines as dask has.

    Parameters
    ----------
    angle, torque : dask.array.Array, shape (\*, n)
        Time is the last axis; others are a batch of records. Chunks along time may have any size; those shorter than a few windows are
        worked on together. Masked values are missing, as NaN is.
    sample_rate, delta : float
        Samples per second, or seconds from one to the next.
    weights : dask.array.Array, shape (\*, n) or (n,), optional
        One over the variance of the noise at every sample, relative to the others, and 0 where it is not to be used.
    angle_unit, torque_unit, method, inertia, damping, stiffness, terms, lag, quantisation, nan_policy, step, settings : optional
        As in :func:`tvident.identify`; parameters are kinds or numbers, terms are built-in ones.

    Returns
    -------
    DaskIdentification
        Dask arrays, of which nothing is computed yet, and ``constants``, which are computed when asked for.

    Raises
    ------
    TypeError
        If the channels are no dask arrays, or a parameter is an array.
    ValueError
        If shapes differ or settings are impossible.
    ImportError
        If dask is missing: install ``tvident[dask]``.

    Notes
    -----
    With everything windowed in strong form, as with ``method="paper"``, the numbers are those of one call in memory, bit for bit, beside
    missing samples too, as long as none has a weight and there is no lag. With everything constant in strong form, the triangular factors
    of the equations of all blocks are merged in a tree, and the constants are those of one call to 1e-12 of themselves, times the condition
    of the equations. In weak form, where some parameters are windowed and others constant, and with weights or a lag, blocks are records
    of their own, whose constants are put together, as in :func:`tvident.identify_file`.

    Every block is one task on one thread: dask has as many threads as there is to do. A task has no state, so where a worker is lost its
    blocks are computed again elsewhere.

    See Also
    --------
    tvident.identify : of arrays in memory.
    tvident.identify_file : of files, on one machine.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import dask.array as da
    >>> import numpy as np
    >>> import tvident
    >>> import tvident.dask
    >>> rig = tvident.simulate_torsional_rig(duration=20.0)
    >>> angle, torque = (da.from_array(one, chunks=6000) for one in (rig.angle, rig.torque))
    >>> result = tvident.dask.identify(angle, torque, sample_rate=1000, method="paper")
    >>> whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    >>> bool(np.array_equal(result.stiffness.compute(), whole.stiffness, equal_nan=True))
    True
    """
    dask, array = imported()
    angle, torque = samples_of("angle", angle), samples_of("torque", torque)
    if angle.shape != torque.shape:
        raise ValueError(
            f"angle and torque must have one shape; got {angle.shape} and {torque.shape}; resample one of them"
        )
    if (delta is None) == (sample_rate is None):
        raise TypeError("an identification needs the sample period; give one of sample_rate= and delta=")
    samples, batch = angle.shape[-1], angle.shape[:-1]
    period = arguments.sample_period(samples, delta=delta, sample_rate=sample_rate)
    every = arguments.whole_number("step", step, least=1)
    nothing = np.zeros(1)
    axis = axis_of(nothing, nothing, angle_unit=angle_unit, torque_unit=torque_unit)
    equation = {
        "inertia": inertia,
        "damping": damping,
        "stiffness": stiffness,
        "terms": terms,
        "lag": lag,
        "quantisation": quantisation,
    }
    given = Given(method, equation, settings, nan_policy, period, axis, 1, weights is not None)
    channels = [_scaled(angle, axis.angle), _scaled(torque, axis.torque)]
    if weights is not None:
        channels.append(weights_of(weights, angle.shape))
    each = [record_of([one[place] for one in channels], given, every) for place in np.ndindex(*batch)]
    columns = {name: stacked([one.columns[name] for one in each], batch) for name in each[0].columns}
    time = array.arange(0, samples, every, chunks=max(samples // every, 1), dtype=float) * period
    units = UNITS if axis.system is ROTARY else LINEAR_UNITS
    return DaskIdentification(
        time,
        columns,
        dask.delayed(_of_first, pure=True)(each[0].settings, alone=not batch),
        units,
        dask.delayed(_of_batch)([one.told for one in each], batch),
        dask.delayed(_advice_of)([one.advice for one in each], alone=not batch),
    )


def _scaled(samples: Any, factor: float) -> Any:
    return samples if factor == 1 else samples.astype(float) * factor


def _of_first(settings: Mapping[str, Any], *, alone: bool) -> dict[str, Any]:
    """Return the settings of a batch: standard errors of windows have factors of their own in every record."""
    return {name: one for name, one in settings.items() if alone or name != "stderr_factors"}


def _advice_of(each: Sequence[Sequence[str] | None], *, alone: bool) -> tuple[str, ...]:
    """Return what is worth doing, of a batch with the record that it is about."""
    if alone:
        return tuple(each[0] or ())
    return tuple(f"record {place}: {line}" for place, lines in enumerate(each) for line in lines or ())


def _of_batch(each: Sequence[tuple[Mapping[str, tuple[float, float]], int]], batch: tuple[int, ...]) -> Any:
    """Return the constants of all records, and their flags, in the shape of the batch."""
    if not batch:
        return each[0]
    names = dict.fromkeys(name for constants, _ in each for name in constants)
    nothing = (np.nan, np.nan)
    pairs = {name: np.array([constants.get(name, nothing) for constants, _ in each]).T for name in names}
    constants = {name: (value.reshape(batch), error.reshape(batch)) for name, (value, error) in pairs.items()}
    return constants, np.array([status for _, status in each], np.uint16).reshape(batch)
