"""First derivatives of PyNumDiff's own benchmark signals: this library against PyNumDiff's methods, tuned by its own search."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import itertools
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import tvident
from accuracy import methods, peers, report
from accuracy.store import Job, Store, key

Array = npt.NDArray[np.float64]
Values = dict[str, Any]

HEADING = "PyNumDiff's signals"
SIGNALS = ("pi_cruise_control", "sine", "triangle", "pop_dyn", "linear_autonomous", "lorenz_x")
NOISES = (0.05, 0.2)
PEERS = ("savgoldiff", "rtsdiff", "splinediff", "kerneldiff")
OURS = 'window_length="auto"'
BEST_FIXED = "Akaike weights, best fixed window"
"""The window is the best of a grid, known afterwards."""

JUMPS = ("triangle", "pi_cruise_control")
"""Signals whose derivatives jump."""

GOAL, JUMPS_GOAL = 0.75, 1.1
"""At most: the geometric mean over all signals, and each that jumps."""

_PERIOD, _DURATION, _BAND_LIMIT = 0.01, 4.0, 3.0


def measure(store: Store, seeds: int, workers: int) -> list[str]:
    """Differentiate every signal at every noise level and return the section of the report."""
    if importlib.util.find_spec("pynumdiff") is None:
        return ["Not measured: it needs pynumdiff."]
    work = list(itertools.product(SIGNALS, NOISES, range(seeds), (*PEERS, OURS, BEST_FIXED)))
    jobs = [Job((_key(*item),), _evaluate, item) for item in work if _key(*item) not in store]
    store.complete(jobs, workers, HEADING)
    return _lines(store, seeds)


def _key(signal: str, noise: float, seed: int, method: str) -> str:
    of = importlib.metadata.version("pynumdiff") if method in PEERS else methods.METHODS["auto-window"].fingerprint()
    return key(signal=signal, noise=noise, recording=seed, method=method, of=of)


def _evaluate(signal: str, noise: float, seed: int, method: str) -> Sequence[Values]:
    samples, truth = simulate(signal, noise, seed)
    if method in PEERS:
        if method == "rtsdiff" and importlib.util.find_spec("numba") is not None:
            from accuracy import compiled  # noqa: PLC0415 - optional

            compiled.install()
        settings = peers.tune(method, samples, _PERIOD, _BAND_LIMIT)
        _, derivative = peers.differentiate(method, samples, _PERIOD, settings)
        return [{"rmse": _rmse(derivative, truth), "settings": {name: str(value) for name, value in settings.items()}}]
    try:
        return [{"rmse": _ours(samples, truth) if method == OURS else _best_fixed(samples, truth)}]
    except (TypeError, ValueError, NotImplementedError) as refusal:
        return [{"unavailable": str(refusal)}]


def simulate(signal: str, noise: float, seed: int) -> tuple[Array, Array]:
    """Return noisy samples of one of PyNumDiff's signals, and its true derivative."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pynumdiff.utils import simulate as signals  # noqa: PLC0415 - optional

        noisy, _, derivative = getattr(signals, signal)(
            duration=_DURATION, dt=_PERIOD, noise_type="normal", noise_parameters=(0, noise), random_seed=1000 + seed
        )
    return np.asarray(noisy), np.asarray(derivative)


def _ours(samples: Array, truth: Array) -> float:
    fit = tvident.fit_local_polynomials(samples, "auto", delta=_PERIOD, max_deriv=1, workers=1)
    return _rmse(fit.derivatives[1], truth)


def _best_fixed(samples: Array, truth: Array) -> float:
    weighted: dict[str, Any] = {"selection": "average"}
    fits = (
        tvident.fit_local_polynomials(samples, length, delta=_PERIOD, max_deriv=1, workers=1, **weighted)
        for length in (7, 11, 15, 21, 31, 41, 61, 81, 121, 161, 201)
    )
    return min(_rmse(fit.derivatives[1], truth) for fit in fits)


def _rmse(found: Array, truth: Array) -> float:
    return float(np.sqrt(np.mean((found - truth) ** 2)))


def _lines(store: Store, seeds: int) -> list[str]:
    """Return the ratio of errors to the best peer's, by signal, and its geometric mean."""
    rows: list[list[str]] = []
    ratios: dict[str, list[float]] = {OURS: [], BEST_FIXED: []}
    refusals: set[str] = set()
    for signal, noise in itertools.product(SIGNALS, NOISES):
        medians: dict[str, float] = {}
        for method in (*PEERS, OURS, BEST_FIXED):
            stored = [store.get(_key(signal, noise, seed, method)) or {} for seed in range(seeds)]
            refusals |= {f"`{method}`: {values['unavailable']}" for values in stored if "unavailable" in values}
            errors = [float(values["rmse"]) for values in stored if "rmse" in values]
            medians[method] = float(np.median(errors)) if errors else float("nan")
        best = min(medians[method] for method in PEERS)
        for method, found in ratios.items():
            found.append(medians[method] / best)
        cells = [f"{medians[method]:.3g}" for method in PEERS]
        limit = JUMPS_GOAL if signal in JUMPS else np.inf
        rows.append([f"{signal}, noise {noise:g}", *cells, *(_ratio(found[-1], limit) for found in ratios.values())])
    means = [_ratio(float(np.exp(np.mean(np.log(found)))), GOAL) for found in ratios.values()]
    rows.append(["geometric mean", *[""] * len(PEERS), *means])
    rows.append(["goal", *[""] * len(PEERS), f"{GOAL:g}; {' and '.join(JUMPS)} {JUMPS_GOAL:g}", ""])
    header = ["RMSE of the first derivative", *PEERS, *(f"{name} over the best peer" for name in ratios)]
    return [
        report.stamp(["savgoldiff"], f"{seeds} seeds, 4 s at 100 Hz, whole record"),
        "",
        f"Every peer is tuned by its own search with a band limit of {_BAND_LIMIT:g} Hz; medians over seeds. Bold: above the goal.",
        "",
        *report.table(header, rows),
        "",
        *(f"* Not available: {refusal}." for refusal in sorted(refusals)),
    ]


def _ratio(value: float, limit: float) -> str:
    return f"**{value:.2f}**" if value > limit else f"{value:.2f}"
