"""Every method on one recording, with the measures that papers on joint impedance use."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._baselines.derivatives import chebyshev_derivatives, lanczos_derivatives, savgol_derivatives
from tvident._baselines.discrete import tvarx
from tvident._baselines.recursive import random_walk_smoother, recursive_least_squares
from tvident._baselines.sums import expanded_least_squares
from tvident._equation import COEFFICIENTS
from tvident._expansion import ExpandedRecord, Expansion, of_one
from tvident._files import aligned
from tvident._identify import identify
from tvident._regression import rolling_least_squares

Array: TypeAlias = npt.NDArray[np.float64]

ValueAndError: TypeAlias = tuple[Array, Array]
"""Inertia, damping and stiffness at every sample and their errors, shape (3, n)."""

_WINDOW, _ORDER = 0.151, 9
"""Seconds and order of the Savitzky-Golay filter: of those tried on the simulated rig, at both levels of noise, the best."""

_LANCZOS = 0.031
_REGRESSION = 0.2
_SIZE = 40
_AVERAGED = 0.1
"""Likewise: seconds of differentiation by integration, of windows, of forgetting; functions of an expansion."""
_BEYOND_ENDS = 0.05
"""Ends of the record that do not count: some methods have no values there."""

_JUMP, _AROUND = 0.1, 0.5
"""A step is a change of so much of the stiffness from sample to sample; it is looked at for so many seconds before and after."""


@dataclass(frozen=True)
class MethodComparison:
    r"""What :func:`tvident.baselines.compare_methods` returns.

    Attributes
    ----------
    table : dict of str to ndarray, shape (m,)
        ``"method"``; ``"inertia"``, ``"damping"``, ``"stiffness"``: root mean square error over the mean truth, %; ``"bias"``,
        ``"random"``: mean and standard deviation of the stiffness's error, %, whose squares make that of the total; ``"vaf"``: variance
        of the torque accounted for, %; ``"rise_time"``: from 10 to 90 % of a step of the stiffness, s; ``"coverage"``: share of its errors
        within 1.96 standard errors; ``"seconds"``: processor time. NaN where there is no truth, no step or no standard error.
    results : dict of str to (ndarray, ndarray)
        Inertia, damping and stiffness, shape (3, n), and their standard errors.

    See Also
    --------
    tvident.baselines.compare_methods : returns it.
    tvident.ModelComparison : models of one record by what they predict.

    References
    ----------
    docs/methods-before.md: the measures of every method on simulated and real recordings.

    Examples
    --------
    >>> import tvident
    >>> from tvident import baselines
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> compared = baselines.compare_methods(rig.angle, rig.torque, sample_rate=1000, methods=["forgetting"])
    >>> values, stderr = compared.results["forgetting"]
    >>> values.shape
    (3, 3000)
    >>> compared.summary().split("  ")[0]
    'method'
    """

    table: dict[str, npt.NDArray[Any]]
    results: Mapping[str, ValueAndError]

    def summary(self) -> str:
        """Return the table as text.

        Returns
        -------
        str

        See Also
        --------
        tvident.baselines : the methods that are compared.
        """
        heads = ("method", "I %", "C %", "K %", "bias %", "random %", "VAF %", "rise s", "coverage", "time s")
        numbers = [name for name in self.table if name != "method"]
        rows = [
            (
                str(method),
                *("" if np.isnan(self.table[name][row]) else f"{self.table[name][row]:.3g}" for name in numbers),
            )
            for row, method in enumerate(self.table["method"])
        ]
        return "\n".join(aligned([heads, *rows]))


def compare_methods(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    sample_rate: float,
    truth: Mapping[str, npt.ArrayLike] | None = None,
    methods: Sequence[str] | None = None,
) -> MethodComparison:
    """Identify one recording with every method, those that came before with settings that suit the simulated rig.

    Parameters
    ----------
    angle, torque : array_like, shape (n,)
        In rad and N m.
    sample_rate : float
        Samples per second.
    truth : mapping of str to array_like, optional
        ``"inertia"``, ``"damping"`` and ``"stiffness"``, shape (n,) or numbers.
    methods : sequence of str, optional
        Some of ``tvident``, ``tvident expansion``, ``paper``, ``savgol, windows``, ``chebyshev, windows``, ``lanczos, windows``,
        ``savgol, expansion``, ``forgetting``, ``random walk``, ``tvarx``. By default all.

    Returns
    -------
    MethodComparison

    Raises
    ------
    ValueError
        If there is no such method.

    See Also
    --------
    tvident.identify : identifies without settings by hand.
    tvident.compare_models : models of one record by what they predict.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion: ``paper``.
    The functions of :mod:`tvident.baselines` name the sources of the others; docs/methods-before.md has settings and tables.

    Examples
    --------
    >>> import tvident
    >>> from tvident import baselines
    >>> rig = tvident.simulate_torsional_rig(duration=5.0, seed=1)
    >>> truth = {"inertia": rig.inertia, "damping": rig.damping, "stiffness": rig.stiffness}
    >>> methods = ["tvident", "forgetting"]
    >>> compared = baselines.compare_methods(rig.angle, rig.torque, sample_rate=1000, truth=truth, methods=methods)
    >>> ours, forgetting = compared.table["stiffness"]
    >>> bool(ours < forgetting)
    True
    """
    angles, torques = (np.asarray(one, np.float64) for one in arguments.channels(angle=angle, torque=torque))
    if angles.ndim != 1 or not (np.isfinite(angles).all() and np.isfinite(torques).all()):
        raise ValueError(
            f"methods are compared on one record without gaps; got shape {angles.shape}; cut a part without missing samples"
        )
    rate = arguments.positive_number("sample_rate", sample_rate)
    if angles.size < 2 * _half_of_test_function(rate) + 1:
        raise ValueError(
            f"methods are compared on a record of a tenth of a second or more; got {angles.size} samples at {rate:g} Hz; record for longer"
        )
    known = None
    if truth is not None:
        known = np.stack([_of_samples(name, truth, angles.shape) for name in COEFFICIENTS])
    if methods is not None and not arguments.is_several(methods):
        raise TypeError(f"methods must be a list; got {arguments.shown(methods)}; write ['tvident', 'forgetting'], say")
    names = list(METHODS) if methods is None else [arguments.one_of("a method", one, tuple(METHODS)) for one in methods]
    results, rows = {}, []
    for name in names:
        begin = time.process_time()
        found = METHODS[name](angles, torques, rate)
        spent = time.process_time() - begin
        results[name] = found
        rows.append({**_measures(found, known, rate), **_explained(found, angles, torques, rate), "seconds": spent})
    order = ("inertia", "damping", "stiffness", "bias", "random", "vaf", "rise_time", "coverage", "seconds")
    table: dict[str, npt.NDArray[Any]] = {"method": np.array(names)}
    return MethodComparison(table | {name: np.array([row[name] for row in rows]) for name in order}, results)


def _measures(found: ValueAndError, truth: Array | None, rate: float) -> dict[str, float]:
    names = ("inertia", "damping", "stiffness", "bias", "random", "rise_time", "coverage")
    if truth is None:
        return dict.fromkeys(names, float("nan"))
    values, errors = found
    ends = int(_BEYOND_ENDS * values.shape[1])
    inside = slice(ends, values.shape[1] - ends)
    wrong = (values - truth)[:, inside]
    size = np.mean(truth, axis=1)
    total = [
        100 * float(np.sqrt(np.nanmean(one**2))) / float(mean) if np.isfinite(one).any() else np.nan
        for one, mean in zip(wrong, size, strict=True)
    ]
    own = wrong[2][np.isfinite(wrong[2])] * 100 / size[2]
    error = errors[2, inside]
    known = np.isfinite(error) & np.isfinite(wrong[2])
    return {
        **dict(zip(COEFFICIENTS, total, strict=True)),
        "bias": float(np.mean(own)) if own.size else np.nan,
        "random": float(np.std(own)) if own.size else np.nan,
        "rise_time": _rise_time(values[2], truth[2], rate),
        "coverage": float(np.mean(np.abs(wrong[2][known]) <= 1.96 * error[known])) if known.any() else np.nan,
    }


def _rise_time(value: Array, truth: Array, rate: float) -> float:
    """Return the median time from 10 to 90 % of the steps of the stiffness."""
    steps = np.flatnonzero(np.abs(np.diff(truth)) > _JUMP * np.mean(truth))
    around, found = int(_AROUND * rate), []
    for step in steps:
        if step < around or step + around >= truth.size:
            continue
        part = (value[step - around : step + around] - truth[step]) / (truth[step + 1] - truth[step])
        late = np.flatnonzero(part >= 0.9)  # noqa: PLR2004 - by definition
        if not late.size:
            found.append(np.inf)
            continue
        early = np.flatnonzero(part[: late[0]] <= 0.1)  # noqa: PLR2004 - by definition
        found.append((late[0] - (early[-1] if early.size else 0)) / rate)
    return float(np.median(found)) if found else float("nan")


def _half_of_test_function(rate: float) -> int:
    """Return how many samples of the test function in which torques are averaged are on either side of its middle."""
    return max(4, int(0.05 * rate))


def _of_samples(name: str, truth: Mapping[str, npt.ArrayLike], shape: tuple[int, ...]) -> Array:
    """Return a true parameter at every sample."""
    if name not in arguments.mapping("truth", truth, "{'inertia': …, 'damping': …, 'stiffness': …}"):
        raise ValueError(f"truth must have inertia, damping and stiffness; got no {name}; add it, or leave truth out")
    values = np.asarray(arguments.any_array(f"truth[{name!r}]", truth[name]), np.float64)
    if values.shape not in {(), (1,), shape}:
        raise ValueError(
            f"truth must have a value for every sample; got {name} of shape {values.shape}; give shape {shape}"
        )
    return np.broadcast_to(values, shape)


def _explained(found: ValueAndError, angle: Array, torque: Array, rate: float) -> dict[str, float]:
    """Return how much of the torque's variance the parameters account for, in averages over a test function of a tenth of a second."""
    values, there = found[0], np.ones((1, angle.size), bool)
    record = ExpandedRecord(
        angle[np.newaxis], torque[np.newaxis], there, there[0], 1 / rate, _half_of_test_function(rate), 7
    )
    everything = slice(0, (record.rows - 1) * record.stride + record.length)
    curves = [(of_one(name), [np.nan_to_num(one)]) for name, one in zip(COEFFICIENTS, values, strict=True)]
    predicted = np.einsum("ij,ij->i", record.noise_kernels(curves, everything)[0, 0], record.windows(angle[everything]))
    measured = record.windows(torque[everything]) @ record.kernels.value
    known = np.asarray(np.all(np.isfinite(values), axis=0), np.float64)
    usable = np.all(record.windows(known[everything]) > 0, axis=1)
    if not usable.any():
        return {"vaf": float("nan")}
    whole = float(np.var(measured[usable]))
    return {"vaf": 100 * (1 - float(np.var((measured - predicted)[usable])) / whole) if whole > 0 else float("nan")}


def _ours(angle: Array, torque: Array, rate: float, **given: Any) -> ValueAndError:
    found = identify(angle, torque, sample_rate=rate, **given)
    return np.stack([getattr(found, name) for name in COEFFICIENTS]), np.stack(
        [found.stderr[name] for name in COEFFICIENTS]
    )


def _expanded(angle: Array, torque: Array, rate: float) -> ValueAndError:
    given = {"inertia": "constant", "damping": "constant", "stiffness": Expansion("bspline")}
    return _ours(angle, torque, rate, **given)


def _regression(derivatives: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Return regressors and which rows have them."""
    angle, velocity, acceleration = derivatives
    rows = np.stack([acceleration, velocity, angle, np.ones(angle.size)], axis=1)
    return rows, np.isfinite(rows).all(axis=1)


def _spread(tracked: Any, there: npt.NDArray[np.bool_]) -> ValueAndError:
    """Return what was tracked in some rows, at every sample."""
    values, errors = np.full((2, 3, there.size), np.nan)
    values[:, there], errors[:, there] = tracked.values[:, :3].T, tracked.stderr[:, :3].T
    return values, errors


def _odd(seconds: float, angle: Array, rate: float) -> int:
    """Return an odd number of samples, as many as the record has at most and polynomials need at least."""
    return int(np.clip(round(seconds * rate) // 2 * 2 + 1, _ORDER + 2, (angle.size - 1) // 2 * 2 + 1))


def _windows(derivatives: Array, torque: Array, rate: float) -> ValueAndError:
    rows, there = _regression(derivatives)
    found = rolling_least_squares(rows[there], torque[there], max(8, round(_REGRESSION * rate)))
    values, errors = np.full((2, 3, torque.size), np.nan)
    values[:, there], errors[:, there] = found.params[:, :3].T, found.stderr[:, :3].T
    return values, errors


def _savgol(angle: Array, rate: float) -> Array:
    return savgol_derivatives(angle, _odd(_WINDOW, angle, rate), _ORDER, delta=1 / rate)


def _sums(angle: Array, torque: Array, rate: float) -> ValueAndError:
    rows, there = _regression(_savgol(angle, rate))
    tracked = expanded_least_squares(rows[there], torque[there], family="chebyshev", sizes=[1, 1, _SIZE, 1])
    return _spread(tracked, there)


def _forgetting(angle: Array, torque: Array, rate: float) -> ValueAndError:
    rows, there = _regression(_savgol(angle, rate))
    return _spread(recursive_least_squares(rows[there], torque[there], forgetting=1 - 1 / (_AVERAGED * rate)), there)


def _walk(angle: Array, torque: Array, rate: float) -> ValueAndError:
    rows, there = _regression(_savgol(angle, rate))
    noise = float(np.std(np.diff(torque)) / np.sqrt(2))
    # A stiffness that changes by about its size within ten seconds.
    size = float(np.std(torque) / np.std(angle))
    steps = [0.0, 0.0, size / np.sqrt(10 * rate), 0.0]
    return _spread(random_walk_smoother(rows[there], torque[there], steps=steps, noise=noise), there)


def _discrete(angle: Array, torque: Array, rate: float) -> ValueAndError:
    every = max(1, round(rate / 100))
    tracked = tvarx(angle, torque, int(2 * rate), delta=1 / rate, every=every)
    return tracked.values.T, tracked.stderr.T


METHODS: dict[str, Callable[[Array, Array, float], ValueAndError]] = {
    "tvident": _ours,
    "tvident expansion": _expanded,
    "paper": lambda angle, torque, rate: _ours(angle, torque, rate, method="paper"),
    "savgol, windows": lambda angle, torque, rate: _windows(_savgol(angle, rate), torque, rate),
    "chebyshev, windows": lambda angle, torque, rate: _windows(
        chebyshev_derivatives(angle, max(4, min(angle.size, int(40 * angle.size / rate))), delta=1 / rate), torque, rate
    ),
    "lanczos, windows": lambda angle, torque, rate: _windows(
        lanczos_derivatives(angle, _odd(_LANCZOS, angle, rate), delta=1 / rate), torque, rate
    ),
    "savgol, expansion": _sums,
    "forgetting": _forgetting,
    "random walk": _walk,
    "tvarx": _discrete,
}
"""Every method by name."""
