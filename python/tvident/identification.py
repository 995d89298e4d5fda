"""Identification of a second-order system whose parameters change."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _core, arguments
from tvident.derivatives import Criterion, plan
from tvident.progress import reporter
from tvident.result import Identification
from tvident.status import Status
from tvident.terms import COEFFICIENTS, Kind, Parameter, Term, TermName, Unknown, all_terms, parameter

Preset: TypeAlias = Literal["paper"]

_PRESETS: dict[str, dict[str, Any]] = {
    "paper": {"window_length": 201, "max_order": 15, "criterion": "aicc", "equations": 200, "kind": "windowed"},
}
_SHORTEST_WINDOW = 5


def identify(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    sample_rate: float | None = None,
    delta: float | None = None,
    t: npt.ArrayLike | None = None,
    preset: Preset = "paper",
    window_length: int | str | None = None,
    max_order: int | None = None,
    criterion: Criterion | None = None,
    equations: int | str | None = None,
    inertia: Parameter | None = None,
    damping: Parameter | None = None,
    stiffness: Parameter | None = None,
    terms: Sequence[TermName | Term | tuple[TermName | Term, Kind]] = (),
    step: int = 1,
    nan_policy: arguments.NanPolicy = "propagate",
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> Identification:
    r"""Identify I(t), C(t) and K(t) in I θ̈ + C θ̇ + K θ = T from a recorded angle and torque.

    In a window around every sample the angle is fitted by polynomials of every order, Akaike's criterion chooses one (equations (2), (8)
    and (9) of the paper) and gives θ̇ and θ̈. In another window of 200 such equations the unknowns are solved for by least squares
    ((3) and (4)).

    Parameters
    ----------
    angle : array_like, shape (\*, n)
        Angle in rad. Time is the last axis; any others are a batch of records.
    torque : array_like, same shape
        Torque in N m.
    sample_rate : float
        Samples per second. Give exactly one of `sample_rate`, `delta` and `t`.
    delta : float
        Sample period in seconds.
    t : array_like, shape (n,)
        Time of every sample in seconds, uniform to a thousandth of the sample period.
    preset : {"paper"}, optional
        What is used where nothing is given: the paper's method.
    window_length : int or str, optional
        Samples in the window of the polynomials, odd, or a duration such as ``"0.2 s"``; 201 in the paper.
    max_order : int, optional
        Highest candidate order; 15 in the paper.
    criterion : {"aicc", "aicc-textbook", "aic", "bic"}, optional
        What chooses the order, as in :func:`tvident.fit_local_polynomials`.
    equations : int or str, optional
        Equations that are solved together around a sample, or a duration; 200 in the paper.
    inertia, damping, stiffness : {"windowed", "constant"}, float or array_like, optional
        ``"windowed"``: unknown, one value for every sample. ``"constant"``: unknown, one value for the record. A number or an array of the
        angle's shape: known; 0 leaves it out.
    terms : sequence, optional
        What else stands on the left-hand side, with an unknown factor: ``"offset"``, ``"coulomb"`` (the sign of the velocity), ``"cubic"``
        (the cube of the angle) or a :class:`Term` of one's own; or a pair of one of these and its kind. Without a kind a term is
        windowed where all unknown parameters are, and constant otherwise.
    step : int, optional
        Every how many samples a result is wanted.
    nan_policy : {"propagate", "raise"}, optional
        Windows that hold a value that is not a finite number are NaN, and no others; or raise.
    workers : int, optional
        Threads; by default ``TVIDENT_WORKERS`` or all processors that this process may use. The numbers do not depend on it.
    progress : bool or callable, optional
        Show a bar, or call a function with the samples done and all of them. What it raises cancels the work.

    Returns
    -------
    Identification
        ``inertia``, ``damping``, ``stiffness``, ``stderr``, ``condition``, ``status`` and more; ``summary()`` says it in words.

    Raises
    ------
    ValueError
        If shapes differ, a window is even or does not fit, `t` is not uniform, kinds are mixed, nothing is unknown, or a name is unknown.
    TypeError
        If an array is complex or holds no numbers, or there is no sample period.

    Notes
    -----
    Within 0.2 s inertia and stiffness are nearly collinear unless several frequencies are excited: under a single sine they cannot be
    told apart at all. ``condition`` says so, and ``stderr`` by how much.

    Standard errors take the equations for independent: see :class:`Identification`.

    The cost is some 60 ns a sample and thread, whatever the windows. Memory is that of the results, but for terms of one's own, which
    need the derivatives of the whole record.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> t = np.arange(4000) / 1000
    >>> angle = 0.2 * np.sin(2 * np.pi * 2 * t) + 0.1 * np.sin(2 * np.pi * 7 * t)
    >>> velocity, acceleration = np.gradient(angle, t), np.gradient(np.gradient(angle, t), t)
    >>> torque = 0.01 * acceleration + 0.05 * velocity + 15 * angle
    >>> result = tvident.identify(angle, torque, sample_rate=1000)
    >>> bool(abs(result.stiffness[2000] - 15) < 0.01)
    True
    """
    angles = arguments.real_array("angle", angle)
    torques = arguments.real_array("torque", torque)
    if angles.shape != torques.shape:
        raise ValueError(
            f"angle and torque must have the same shape; got {angles.shape} and {torques.shape}; cut or reshape one of them"
        )
    samples = angles.shape[-1]
    if sample_rate is None and delta is None and t is None:
        raise TypeError("identify needs the sample period; got none; give sample_rate=, delta= or t=")
    period = arguments.sample_period(samples, delta=delta, sample_rate=sample_rate, t=t)
    chosen = _PRESETS[arguments.one_of("preset", preset, get_args(Preset))]
    given = {"window_length": window_length, "max_order": max_order, "criterion": criterion, "equations": equations}
    settings: dict[str, Any] = chosen | {name: value for name, value in given.items() if value is not None}

    length = arguments.window_length("window_length", settings["window_length"], period, odd=True)
    arguments.check_window("window_length", length, samples, least=_SHORTEST_WINDOW)
    rows = arguments.window_length("equations", settings["equations"], period, odd=False)
    for name, array in (("angle", angles), ("torque", torques)):
        arguments.check_nan(name, array, nan_policy)
    start = 0.0 if t is None else float(np.asarray(t)[0])
    time = start + np.arange(samples, dtype=np.float64) * period

    parameters = {
        name: parameter(name, settings["kind"] if value is None else value, angles.shape)
        for name, value in zip(COEFFICIENTS, (inertia, damping, stiffness), strict=True)
    }
    kinds: dict[str, Kind] = {name: value for name, value in parameters.items() if isinstance(value, str)}
    default: Kind = "windowed" if all(kind == "windowed" for kind in kinds.values()) else "constant"
    extra = all_terms(terms, default)
    unknowns = [Unknown(name, kind) for name, kind in kinds.items()] + extra
    kind = _only_kind(unknowns)

    core_plan = plan(
        length,
        order=None,
        max_order=arguments.whole_number("max_order", settings["max_order"], least=0),
        criterion=arguments.one_of("criterion", settings["criterion"], get_args(Criterion)),
        derivatives=(0, 1, 2),
        delta=period,
        noise=True,
    )
    every = arguments.whole_number("step", step, least=1)
    threads = arguments.worker_count(workers)
    motions = _core.Motions(
        angles,
        torques,
        [None if isinstance(value, str) else value for value in parameters.values()],
        _columns(extra, core_plan, angles, time, threads),
    )
    found = _Found(angles.shape[:-1], [unknown.name for unknown in unknowns])
    with reporter(progress, "identification") as report:
        if kind == "windowed":
            arguments.check_window("equations", rows, samples, least=len(unknowns) + 1)
            found.windowed(core_plan, motions, rows, step=every, workers=threads, progress=report)
        else:
            found.constant(core_plan, motions, step=every, workers=threads, progress=report)
    found.add_known({name: value for name, value in parameters.items() if not isinstance(value, str)}, every)
    return Identification(
        time=time[::every],
        values=found.values,
        errors=found.errors,
        covariances=found.covariances,
        constants=found.constants,
        terms=[unknown.name for unknown in extra],
        condition=found.condition,
        residual_std=found.residual_std,
        order=found.order,
        status=found.status,
        settings={
            "preset": preset,
            "sample_rate": 1 / period,
            "window_length": length,
            "order": None,
            "max_order": settings["max_order"],
            "criterion": settings["criterion"],
            "equations": rows,
            "kinds": {name: kinds.get(name, "known") for name in COEFFICIENTS}
            | {unknown.name: unknown.kind for unknown in extra},
            "step": every,
        },
    )


def _only_kind(unknowns: list[Unknown]) -> Kind:
    """Return the kind that all unknowns have."""
    if not unknowns:
        raise ValueError("at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one")
    kinds = {unknown.kind for unknown in unknowns}
    if len(kinds) > 1:
        listed = ", ".join(f"{unknown.name} {unknown.kind}" for unknown in unknowns)
        raise ValueError(f"all unknowns must be of one kind; got {listed}; make all of them 'windowed' or 'constant'")
    return kinds.pop()


def _columns(
    extra: list[Unknown],
    core_plan: _core.LocalPolynomials,
    angles: npt.NDArray[np.number],
    time: npt.NDArray[np.float64],
    workers: int | None,
) -> list[npt.NDArray[np.number] | str]:
    """Return what the core needs of every further term: its name, or its value at every sample."""
    if all(unknown.own is None for unknown in extra):
        return [unknown.name for unknown in extra]
    (angle, velocity, _), *_ = core_plan.estimate(angles, workers=workers)
    return [unknown.own.values(time, angle, velocity) if unknown.own else unknown.name for unknown in extra]


class _Found:
    """Results of a batch of records, put back into the batch's shape."""

    def __init__(self, batch: tuple[int, ...], names: list[str]) -> None:
        self._batch = batch
        self._names = names
        self.values: dict[str, npt.NDArray[np.float64]] = {}
        self.errors: dict[str, npt.NDArray[np.float64]] = {}
        self.covariances: dict[frozenset[str], npt.NDArray[np.float64]] = {}
        self.constants: dict[str, tuple[Any, Any]] = {}

    def _shaped(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return array.reshape(*self._batch, array.shape[-1])

    def windowed(self, core_plan: _core.LocalPolynomials, motions: _core.Motions, rows: int, **options: Any) -> None:
        pairs = list(combinations(range(sum(name in COEFFICIENTS for name in self._names)), 2))
        parameters, errors, covariances, deviation, condition, status, order = _core.identify_windowed(
            core_plan, motions, rows, pairs, **options
        )
        for index, name in enumerate(self._names):
            self.values[name] = self._shaped(parameters[:, index])
            self.errors[name] = self._shaped(errors[:, index])
        for index, (one, other) in enumerate(pairs):
            pair = frozenset((self._names[one], self._names[other]))
            self.covariances[pair] = self._shaped(covariances[:, index])
        self.residual_std, self.condition = self._shaped(deviation), self._shaped(condition)
        self.status, self.order = self._shaped(status), self._shaped(order)

    def constant(self, core_plan: _core.LocalPolynomials, motions: _core.Motions, **options: Any) -> None:
        values, covariance, deviation, condition, status, order = _core.identify_constant(core_plan, motions, **options)
        self.status, self.order = self._shaped(status), self._shaped(order)
        errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))

        def spread(array: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
            """Repeat one value a record for every sample."""
            return np.broadcast_to(array.reshape(*self._batch, 1), self.status.shape)

        for index, name in enumerate(self._names):
            self.values[name], self.errors[name] = spread(values[:, index]), spread(errors[:, index])
            value, error = values[:, index].reshape(self._batch), errors[:, index].reshape(self._batch)
            self.constants[name] = (value, error) if self._batch else (float(value), float(error))
        for one, other in combinations([name for name in self._names if name in COEFFICIENTS], 2):
            entry = covariance[:, self._names.index(one), self._names.index(other)]
            self.covariances[frozenset((one, other))] = spread(entry)
        self.residual_std, self.condition = spread(deviation), spread(condition)
        undetermined = np.isinf(self.condition)
        flags = np.uint16(Status.INVALID | Status.RANK_DEFICIENT)
        self.status = np.where(undetermined, self.status | flags, self.status)

    def add_known(self, known: dict[str, float | npt.NDArray[np.number]], step: int) -> None:
        """Add what was known beforehand, without error."""
        for name, value in known.items():
            every = value if isinstance(value, float) else value[..., ::step]
            self.values[name] = np.broadcast_to(np.asarray(every, dtype=np.float64), self.status.shape)
            self.errors[name] = np.broadcast_to(np.float64(0), self.status.shape)
