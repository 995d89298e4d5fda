"""What other libraries find: derivatives by PyNumDiff in the paper's least squares, and a Kalman smoother of statsmodels.

Both are given what their users would have: the band of the excitation, and which parameters change. Packages are imported where they are
used, so that the rest works without them.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import optimize

import tvident
from accuracy import errors

Array = npt.NDArray[np.float64]
Values = dict[str, Any]
Tuning = Literal["rule", "truth"]
"""How settings are chosen: by the library's own rule, or with the truth in hand."""

EQUATIONS = 200
"""Equations that are solved together, as in the paper."""

BAND_LIMIT = 12.0
"""Highest frequency of the excitation, Hz: what PyNumDiff's rule asks its user for."""

_TUNED_ON = 2000
"""Samples, from the middle of the record, that PyNumDiff's settings are tuned on: its search takes hundreds of evaluations."""

_SEARCH: dict[str, dict[str, Any]] = {
    "savgoldiff": {"degree": [3, 5, 7], "window_size": [51, 131, 201], "smoothing_win": [3, 31]},
    "kerneldiff": {"kernel": {"gaussian", "friedrichs"}, "window_size": [5, 21, 51], "num_iterations": [1, 5]},
    "butterdiff": {"filter_order": {2, 3, 4, 6}, "cutoff_freq": [0.02, 0.05, 0.1, 0.5], "num_iterations": 1},
    "spectraldiff": {},
    "rtsdiff": {"forwardbackward": False, "order": {2, 3}, "log_qr_ratio": [12.0]},
}
"""Where PyNumDiff's search starts: its defaults, less what is hopeless at 1 kHz or takes too long."""

DIFFERENTIATORS = tuple(_SEARCH)
"""Methods of PyNumDiff that a record of 40 000 samples can be given to; its splines take time in the square of its length."""


def pynumdiff(recording: tvident.Recording, name: str, tuning: Tuning) -> Values:
    """Differentiate twice by one of PyNumDiff's methods, each time tuned anew, and solve the paper's equations."""
    piece = slice((recording.time.size - _TUNED_ON) // 2, (recording.time.size + _TUNED_ON) // 2)
    period = 1 / recording.sample_rate
    settings: list[dict[str, str]] = []
    signals = [recording.angle]
    for truth in (recording.true_velocity, recording.true_acceleration):
        tuned = tune(name, signals[-1][piece], period, truth[piece] if tuning == "truth" else BAND_LIMIT, _SEARCH[name])
        smooth, derivative = differentiate(name, signals[-1], period, tuned)
        signals = [smooth, derivative] if not settings else [*signals, derivative]
        settings.append({key: str(value) for key, value in tuned.items()})
    angle, velocity, acceleration = signals
    rows = np.stack([acceleration, velocity, angle], axis=1)
    solved = tvident.rolling_least_squares(rows, recording.torque, EQUATIONS, workers=1).params
    found = {"inertia": solved[:, 0], "damping": solved[:, 1], "stiffness": solved[:, 2]}
    values: Values = errors.of_parameters(found, recording)
    return values | {"acceleration": errors.of_acceleration(acceleration, recording), "settings": settings}


def differentiate(name: str, samples: Array, period: float, settings: dict[str, Any]) -> tuple[Array, Array]:
    """Return the smoothed samples and their derivative by one of PyNumDiff's methods."""
    with _quiet():
        smooth, derivative = getattr(_pynumdiff(), name)(samples, period, **settings)
    return smooth, derivative


def tune(
    name: str, samples: Array, period: float, truth: Array | float, search: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return the settings that PyNumDiff's search finds, given the true derivative or else the band limit in Hz."""
    goal = {"bandlimit": truth} if isinstance(truth, float) else {"dxdt_truth": truth, "padding": "auto"}
    with _quiet():
        from pynumdiff.optimize import optimize as search_for  # noqa: PLC0415 - optional

        method = getattr(_pynumdiff(), name)
        found, _ = search_for(method, samples, period, search_space_updates=search or {}, parallel=False, **goal)
    return dict(found)


def kalman(recording: tvident.Recording, tuning: Tuning) -> Values:
    """Smooth a time-varying regression of the torque on the paper's derivatives, whose changing parameters walk at random.

    Inertia and damping walk only where they change. The variances of the steps over that of the torque maximise the likelihood; or, with
    the truth, are those times the power of ten with the least error of stiffness.
    """
    fit = tvident.fit_local_polynomials(recording.angle, 201, sample_rate=recording.sample_rate, workers=1)
    walking = np.array([float(np.ptp(getattr(recording, name))) > 0 for name in ("inertia", "damping")] + [True])
    regression = _WalkingRegression(fit.derivatives[::-1].T, recording.torque, walking)
    ratios = regression.most_likely()
    offsets = (0.0,) if tuning == "rule" else np.arange(-6.0, 5.0)
    candidates = [errors.of_parameters(regression.smoothed(ratios + offset), recording) for offset in offsets]
    best: Values = min(candidates, key=lambda values: values["stiffness"])
    return best | {"settings": {"log10 of variance ratios": [round(float(ratio), 2) for ratio in ratios]}}


class _WalkingRegression:
    """torque = inertia θ̈ + damping θ̇ + stiffness θ + noise, some of the parameters being random walks."""

    _BLOCK = 5
    """Samples that are averaged into one equation: 200 Hz hold all of a signal below 12 Hz."""

    def __init__(self, rows: Array, torque: Array, walking: npt.NDArray[np.bool_]) -> None:
        from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother  # noqa: PLC0415 - optional

        self._samples = torque.size
        blocks = torque.size // self._BLOCK
        means = rows[: blocks * self._BLOCK].reshape(blocks, self._BLOCK, 3).mean(axis=1)
        # Parameters are scaled so that 1 is their size on average over the record.
        self._scale = np.abs(np.linalg.lstsq(rows, torque, rcond=None)[0])
        self._walking = walking
        model = KalmanSmoother(k_endog=1, k_states=3, k_posdef=int(walking.sum()))
        model.bind(torque[: blocks * self._BLOCK].reshape(blocks, self._BLOCK).mean(axis=1))
        model["design"] = np.ascontiguousarray((means * self._scale).T[np.newaxis])
        model["transition"] = np.eye(3)
        model["selection"] = np.eye(3)[:, walking]
        model["obs_cov"] = np.eye(1)
        model.initialize_approximate_diffuse(1e4)
        model.loglikelihood_burn = 3
        # The variance of the noise is computed, not searched for.
        model.filter_concentrated = True
        self._model = model

    def _set(self, ratios: Array) -> None:
        self._model["state_cov"] = np.diag(10.0**ratios)

    def most_likely(self) -> Array:
        """Return the decimal logarithms of the steps' variances over the noise's, by maximum likelihood."""

        def cost(ratios: Array) -> float:
            self._set(np.clip(ratios, -15, 5))
            return -float(self._model.loglike())

        count = int(self._walking.sum())
        starts = [np.full(count, start) for start in (-7.0, -4.0, -1.0)]
        start = min(starts, key=cost)
        found = optimize.minimize(
            cost, start, method="Nelder-Mead", options={"xatol": 0.05, "fatol": 0.1, "maxiter": 150}
        )
        return np.asarray(np.clip(found.x, -15, 5))

    def smoothed(self, ratios: Array) -> dict[str, Array]:
        """Return the smoothed parameters at every sample."""
        self._set(ratios)
        states = self._model.smooth().smoothed_state * self._scale[:, np.newaxis]
        centres = np.arange(states.shape[1]) * self._BLOCK + (self._BLOCK - 1) / 2
        return {
            name: np.interp(np.arange(self._samples), centres, state)
            for name, state in zip(("inertia", "damping", "stiffness"), states, strict=True)
        }


def _pynumdiff() -> Any:
    import pynumdiff as package  # noqa: PLC0415 - optional

    return package


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence PyNumDiff: it warns of methods that need further packages, and of rounding of its own settings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
