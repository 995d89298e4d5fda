"""The torque that the identified equation of motion predicts, beside the one that was recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._derivatives import fit_local_polynomials
from tvident._equation import BUILT_IN, COEFFICIENTS, OFFSET
from tvident._results.response import Model, without_gaps

Array: TypeAlias = npt.NDArray[np.float64]

_BLOCK = 1 << 14
"""Samples that are transformed together: they stay in the cache."""

SHORTEST = 9
"""Samples that a window of the motion at single samples has at least."""

POLYNOMIALS: dict[str, Any] = {"max_order": 4, "criterion": "aicc", "selection": "window"}
"""Of the motion at single samples."""

_TOUCHED = 1e-9
"""Averages of a mask above this hold a masked sample; below it they are rounding."""


def compared(
    model: Model, angle: npt.NDArray[np.number], torque: npt.NDArray[np.number], settings: Mapping[str, Any]
) -> tuple[Array, Array]:
    """Return the recorded torque and the predicted one as the form compares them; NaN where samples are missing.

    The weak form compares averages over its test function φ, in which derivatives fall to φ and their noise is small; the strong form
    takes derivatives of the local polynomials.
    """
    late = float(model.lags[0])
    on_time: Array = np.asarray(torque, np.float64)
    if late != 0:
        places = np.arange(angle.size, dtype=np.float64)
        on_time = np.asarray(np.interp(places + late, places, on_time, right=np.nan), np.float64)
    if settings["form"] == "strong":
        names = ("max_order", "criterion", "selection")
        fit: Any = fit_local_polynomials(
            without_gaps(angle),
            settings["window_length"],
            delta=model.period,
            **{name: settings[name] for name in names},
        )
        smooth, velocity, acceleration = np.asarray(fit.derivatives, np.float64)
        # Rows of the strong form need whole windows: off their centres, and across what is missing, derivatives are no measurement.
        touched = touched_by(~np.isfinite(angle), settings["window_length"] // 2)
        motion = dict(zip(COEFFICIENTS, (acceleration, velocity, smooth), strict=True))
        predicted = _added(np.zeros(angle.size), model, motion, lambda values: values, (smooth, velocity))
        predicted[touched] = np.nan
        return on_time, predicted
    half = settings["window_length"] // 2
    kernels = kernels_of(half, settings["exponent"], model.period)
    missing = ~(np.isfinite(angle) & np.isfinite(on_time))
    touched = touched_by(missing, half)
    filled: Array = np.asarray(angle, np.float64)
    if missing.any():
        filled, on_time = (np.where(missing, 0.0, one) for one in (filled, on_time))
    # What is constant has one kernel together.
    constant, changing = np.zeros((1, kernels.shape[1])), {}
    for name, kernel in zip(COEFFICIENTS, kernels, strict=True):
        if model.values[name].size == 1:
            constant += model.values[name].item() * kernel
        else:
            changing[name] = kernel
    together, *averages = correlated_with(filled, np.stack([*constant, *changing.values()]))
    # Terms are functions of the motion at the samples: an average of the angle, cubed, is no average of its cube.
    is_curved = bool(set(model.values) - {*COEFFICIENTS, OFFSET})
    predicted = _added(
        together,
        model,
        dict(zip(changing, averages, strict=True)),
        lambda values: correlated_with(values, kernels[2:])[0],
        _at_samples(filled, half, model.period) if is_curved else (filled, filled),
    )
    (measured,) = correlated_with(on_time, kernels[2:])
    for one in (measured, predicted):
        one[touched] = np.nan
    return measured, predicted


def _at_samples(angle: Array, half: int, period: float) -> tuple[Array, Array]:
    """Return angle and velocity at the samples, by local polynomials in windows half as long as the test function."""
    fit: Any = fit_local_polynomials(angle, max(SHORTEST, half | 1), delta=period, **POLYNOMIALS)
    smooth, velocity, _ = np.asarray(fit.derivatives, np.float64)
    return smooth, velocity


def _added(
    total: Array,
    model: Model,
    motion: Mapping[str, Array],
    averaged: Callable[[Array], Array],
    at_samples: tuple[Array, Array],
) -> Array:
    """Add to a part of the equation's left-hand side what changes with the motion, and terms: averages of functions at the samples."""
    for name, factor in model.values.items():
        if name in COEFFICIENTS and name not in motion:
            continue
        if name == OFFSET:
            regressor = np.ones(1)
        elif name in motion:
            regressor = motion[name]
        elif name in model.own:
            regressor = _where_known(
                np.asarray(model.own[name].values(_times(model, total.size), *(one.copy() for one in at_samples))),
                averaged,
            )
        else:
            inner = model.stribeck[:1] if BUILT_IN[name].inner else ()
            regressor = averaged(BUILT_IN[name].function(np, *at_samples, *inner))
        factors, regressors = (np.broadcast_to(one, total.shape) for one in (factor, regressor))
        # Products of a whole record take longer to be put somewhere than to be computed.
        for first in range(0, total.size, _BLOCK):
            some = slice(first, first + _BLOCK)
            total[some] += factors[some] * regressors[some]
    return total


def _times(model: Model, samples: int) -> Array:
    return np.asarray(model.start + np.arange(samples) * model.period)


def _where_known(values: npt.NDArray[np.number], averaged: Callable[[Array], Array]) -> Array:
    """Return averages of a term; NaN where they touch a sample of which it says nothing, as a delay does of the first ones."""
    missing = ~np.isfinite(values)
    found = averaged(np.where(missing, 0.0, values).astype(np.float64))
    if not missing.any():
        return found
    return np.where(np.abs(averaged(missing.astype(np.float64))) > _TOUCHED, np.nan, found)


def touched_by(missing: npt.NDArray[np.bool_], half: int) -> npt.NDArray[np.bool_]:
    """Return around which samples a window does not fit, or touches a sample that is missing."""
    touched = np.ones(missing.size, bool)
    if not missing.any():
        touched[half : missing.size - half] = False
    elif missing.size > 2 * half:
        count = np.concatenate([[0], np.cumsum(missing)])
        touched[half : missing.size - half] = count[2 * half + 1 :] - count[: -2 * half - 1] > 0
    return touched


def kernels_of(half: int, exponent: float, period: float) -> Array:
    """Return φ″, -φ′ and φ at the samples, of which φ sums to one, and only φ leaves a constant."""
    u = np.arange(-half, half + 1) / half
    phi = np.polynomial.Polynomial([1, 0, -1]) ** int(exponent)
    seconds = half * period
    rows = np.array([phi.deriv(2)(u) / seconds**2, -phi.deriv(1)(u) / seconds, phi(u)]) / phi(u).sum()
    return np.asarray(rows + np.outer(np.array([0.0, 0.0, 1.0]) - rows.sum(axis=1), rows[2]))


def noise_of_compared(torque: npt.NDArray[np.number], settings: Mapping[str, Any]) -> float:
    """Return the variance that the torque's own noise has in what is compared, as if it were white; NaN where the record is too short."""
    there = np.asarray(torque, np.float64)
    variance = float(_core.noise(there[np.isfinite(there)])[0].sigma) ** 2
    if settings["form"] == "strong":
        return variance
    *_, phi = kernels_of(settings["window_length"] // 2, settings["exponent"], 1.0)
    return variance * float(phi @ phi)


@np.errstate(all="ignore")  # samples that are no numbers for the core may be beyond doubles in sums
def correlated_with(values: Array, kernels: Array) -> Array:
    """Return the sums of samples around each one, weighted by each kernel; zero where they do not fit. By overlap-save."""
    width = kernels.shape[1]
    result = np.zeros((len(kernels), values.size))
    if values.size < width:
        return result
    # A mean that is not zero would cost digits, and a kernel makes of a constant its sum.
    mean = float(values.mean())
    sums = mean * kernels.sum(axis=1, keepdims=True)
    length = max(_BLOCK, 1 << (4 * width).bit_length())
    reach = length - width + 1
    spectra = np.fft.rfft(kernels[:, ::-1], length)
    for first in range(0, values.size - width + 1, reach):
        piece = values[first : first + length] - mean
        found = np.fft.irfft(np.fft.rfft(piece, length) * spectra, length)[:, width - 1 : piece.size]
        place = first + width // 2
        result[:, place : place + found.shape[1]] = found + sums
    return result
