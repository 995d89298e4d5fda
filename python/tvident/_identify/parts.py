"""Parts of a record that is longer than memory, or than a machine: the strong form gives them the numbers of the whole record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from inspect import signature
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives import SHORTEST_WINDOW
from tvident._equation import COEFFICIENTS, Term
from tvident._identify.batch import estimates
from tvident._identify.call import identify
from tvident._identify.channels import MotionChannels
from tvident._identify.data import Data
from tvident._identify.improved import TESTED
from tvident._identify.methods import Method, StrongForm
from tvident._identify.prepared import prepared
from tvident._identify.searched import Searched
from tvident._identify.settings import Request, plain, resolve
from tvident._identify.task import Task
from tvident._identify.weighted import Weights
from tvident._results import Estimates, Identification
from tvident._status import Status
from tvident._units import Axis

Span = tuple[int, int]
"""The first of some samples, and the one after the last."""

Rows = _core.FactoredRows
"""The triangular factor of some equations: its numbers row by row, its columns, and how many equations it stands for."""


@dataclass(frozen=True)
class Held:
    """Parts of a long record that are in memory, one after the other.

    Parameters
    ----------
    angle, torque : ndarray
        In the units of results.
    spans : sequence of (int, int)
        Where each part lies in the record.
    weights : ndarray, optional
        Of the samples, where they were given.
    """

    angle: npt.NDArray[np.number]
    torque: npt.NDArray[np.number]
    spans: Sequence[Span]
    weights: npt.NDArray[np.number] | None = None

    @property
    def counts(self) -> bool:
        """Whether a sample has a weight."""
        return self.weights is None or bool(np.any(self.weights))

    @property
    def is_whole(self) -> bool:
        """Whether no sample is missing."""
        # A sum costs a fraction of the question, and is finite unless a number is not, or numbers are very large.
        with np.errstate(all="ignore"):
            return all(np.isfinite(one.sum()) or bool(np.isfinite(one).all()) for one in (self.angle, self.torque))


@dataclass(frozen=True)
class _NothingFound:
    """What the settings of the strong form ask of what was found, before anything is."""

    window_length: int
    regression_window: int
    unknowns: Sequence[Any]


@dataclass(frozen=True)
class _KindFound:
    kind: str
    factor: float | None = None


def requested(
    method: Method, given: Mapping[str, Any], settings: Mapping[str, Any] | None, sample_rate: float
) -> Request:
    """Return what is asked for of a record that is not looked at yet.

    Raises
    ------
    TypeError
        If a parameter is known at every sample, or a term is a function: nothing of a long record is as long as it.
    ValueError
        If settings are of a batch.
    """
    for name in COEFFICIENTS:
        value = given.get(name)
        if value is not None and not isinstance(value, str | float | int | np.number):
            raise TypeError(
                f"{name} of a long record must be a number or a kind; got {arguments.shown(value)}; give a number"
            )
    terms = given.get("terms")
    if terms is not None and (isinstance(terms, str) or not isinstance(terms, Sequence)):
        raise TypeError(f"terms must be a list; got {arguments.shown(terms)}; write terms=['offset', 'coulomb']")
    for term in terms or ():
        own = term[0] if isinstance(term, tuple | list) and term else term
        if isinstance(own, Term):
            raise TypeError(
                f"terms of a long record must be built-in; got {own.name!r}; identify parts of it in memory"
            )
    request = resolve(method, given, settings, sample_rate)
    several = next((name for name, each in request.by_record.items() if name != "lag" or len(each) > 1), None)
    if several is not None:
        got = arguments.shown(list(request.by_record[several]))
        raise ValueError(
            f"settings must be those of one record; got {several} {got} of a batch; give those of one of its records: result[0].settings"
        )
    return request


_CALL = signature(identify)


def identify_part(
    held: Held, options: Mapping[str, Any], wanted: Span | None, report: Any = None, *, diagnose: bool = True
) -> Identification:
    """Identify a part of a long record as a record of its own.

    Parameters
    ----------
    held : Held
        One part, with neighbours of the samples that are wanted.
    options : mapping of str to object
        As in :func:`identify`.
    wanted : (int, int), optional
        The samples of the record at which numbers are wanted; others may be NaN. All of the part if it is None.
    report : callable, optional
        Is told of the progress.
    diagnose : bool
        Look for what may be missing in the equation, and compare test functions of all widths.
    """
    return _task_of_part(held, options, wanted).run(report, diagnose=diagnose and held.counts)


def estimate_part(
    held: Held, options: Mapping[str, Any], wanted: Span | None, report: Any = None, *, diagnose: bool = True
) -> Estimates:
    """Identify a part of a long record as :func:`identify_part` does, and return its numbers alone."""
    return _task_of_part(held, options, wanted).estimates(report, diagnose=diagnose and held.counts)


def _task_of_part(held: Held, options: Mapping[str, Any], wanted: Span | None) -> Task:
    """Return the task of a part of a long record."""
    if not held.counts:
        # What has no weight is missing, here all of it.
        held = replace(held, angle=np.full(held.angle.size, np.nan), weights=None)
        options = {**options, "nan_policy": "omit"}
    call = _CALL.bind(held.angle, held.torque, weights=held.weights, **options)
    call.apply_defaults()
    first = held.spans[0][0]
    own = None if wanted is None else (max(wanted[0] - first, 0), min(wanted[1] - first, held.angle.size))
    task = prepared({**call.arguments, "wanted": own})
    assert isinstance(task, Task)  # noqa: S101 - what is known of a long record is a number
    return task


class Long(Task):
    """A record of which parts are looked at, one after the other or on several machines.

    Parameters
    ----------
    request : Request
    samples : int
        Of the whole record.
    period : float
        Seconds from one sample to the next.
    axis : Axis
        Of the units of results.
    propagate : bool
        Windows with a missing sample have no number.
    step : int
        Every how many samples numbers are wanted.
    weighted : bool
        Samples have weights.
    """

    def __init__(
        self,
        request: Request,
        samples: int,
        period: float,
        axis: Axis,
        *,
        propagate: bool = False,
        step: int = 1,
        weighted: bool = False,
    ) -> None:
        empty = np.zeros(1)
        # As many times as the record has samples, at none of which anybody looks.
        time = np.broadcast_to(np.float64(0), (samples,))
        motion = MotionChannels(empty)
        weights = Weights(np.ones(1)) if weighted else None
        data = Data(empty, empty, motion, None, time, period, None, propagate, step, None, axis=axis, weights=weights)
        super().__init__(data, request)
        self._propagate, self._step, self._samples = propagate, step, samples

    @property
    def is_windowed(self) -> bool:
        """Whether parts have the numbers of the whole record, bit for bit."""
        return self._is_plain and {one.kind for one in self._unknowns} == {"windowed"}

    @property
    def is_constant(self) -> bool:
        """Whether the equations of parts add up to those of the whole record."""
        kinds = {"constant" if one.kind == "auto" and one.name != "stiffness" else one.kind for one in self._unknowns}
        return self._is_plain and kinds == {"constant"}

    @property
    def _is_plain(self) -> bool:
        form, request = self._request.form, self._request
        return (
            isinstance(form, StrongForm)
            and self._data.weights is None
            and not form.filter_torque
            and form.variation == "constant"
            and request.lag == 0
            and request.period is None
            and all(one.own is None and not one.inner for one in self._terms)
        )

    @property
    def names(self) -> list[str]:
        """Of the unknowns, in the order of the core."""
        return list(self._names)

    @property
    def known(self) -> list[str]:
        """Names of what is known."""
        return list(self._known)

    @property
    def in_weak_form(self) -> dict[str, Any]:
        """Arguments of :func:`identify` that ask the weak form for the same equation, with what it tests in place of windows."""
        settings, known = self.settings(), self.values_known()
        kinds = {name: known[name][0] if kind == "known" else kind for name, kind in settings["kinds"].items()}
        given = {
            name: kind if kind == "constant" or name in known else TESTED[name]
            for name, kind in kinds.items()
            if name in COEFFICIENTS
        }
        return {**given, "terms": [name for name, _ in settings["terms"]], "lag": settings["lag"]}

    def polynomials(self, held: Held, wanted: Span) -> _core.LocalEstimates:
        """Return what is known of the polynomials around some samples."""
        return self._polynomials().estimate(
            held.angle, step=self._step, part=(wanted, held.spans[0], self._samples), workers=1
        )

    def settings(self, factors: Sequence[float] | None = None) -> dict[str, Any]:
        """Return inputs and choices of the strong form, as those of a result, with factors of standard errors where they are known."""
        form = self._request.form
        length = self._length("window_length", form.window_length, least=SHORTEST_WINDOW)
        rows = arguments.window_length("regression_window", form.regression_window, self._data.period, odd=False)
        known = factors if factors is not None else [None] * len(self._unknowns)
        each = zip(self._unknowns, known, strict=True)
        kinds = [_KindFound("constant" if one.kind == "auto" else one.kind, factor) for one, factor in each]
        found: Any = _NothingFound(length, rows, kinds)
        return plain(self._settings([found], Searched({})))

    def around(self, wanted: Span) -> Span:
        """Return the samples that windows around some need."""
        return self._strong.around(*wanted, self._samples)

    def spans_of_scatter(self) -> list[Span]:
        """Return the parts that factors of standard errors are found in."""
        return self._strong.parts_of_scatter(self._samples)

    def factors(self, held: Held, workers: int | None) -> list[float]:
        """Return by how much standard errors exceed those of independent equations, one factor an unknown."""
        (factors,) = self._strong.scatter(self._of(held), propagate=self._propagate, workers=workers)
        return factors

    def rows(self, held: Held, wanted: Span, workers: int | None) -> Rows:
        """Return the triangular factor of the equations around some samples."""
        return self._strong.rows(self._of(held), wanted, propagate=self._propagate, workers=workers)

    def values_known(self) -> dict[str, tuple[float, float]]:
        """Return what is known, with no error."""
        return {name: (float(value), 0.0) for name, value in self._known.items() if isinstance(value, float)}

    def constants(
        self, held: Held, rows: Rows, workers: int | None
    ) -> tuple[dict[str, tuple[float, float]], int, float, float]:
        """Return what all equations tell: values with errors by name, flags of the record, condition number and residuals.

        Parameters
        ----------
        held : Held
            The parts of :meth:`spans_of_scatter`.
        rows : Rows
            Of the whole record.
        workers : int, optional
        """
        count = len(self._names)
        found = self._strong.constants(self._of(held), rows, propagate=self._propagate, workers=workers)
        values, covariance = (
            ([np.nan] * count, [np.nan] * count**2) if found is None else (found.values, found.covariance)
        )
        residual, condition = (np.nan, np.inf) if found is None else (found.residual, found.condition)
        errors = np.sqrt(np.reshape(covariance, (count, count)).diagonal())
        flags = Status(0)
        if not condition < np.inf:
            flags = Status.RANK_DEFICIENT
        elif condition > _core.HARDLY_TOLD_APART:
            flags = Status.ILL_CONDITIONED
        pairs = zip(values, errors.tolist(), strict=True)
        return dict(zip(self._names, pairs, strict=True)), int(flags), condition, residual

    def windows(
        self,
        held: Held,
        wanted: Span,
        factors: Sequence[float],
        workers: int | None = None,
        report: Callable[[int, int], object] | None = None,
    ) -> Estimates:
        """Return what windows around some samples say."""
        found = _core.identify(
            self._of(held),
            ["windowed"] * len(self._names),
            self._strong,
            delta=self._data.period,
            lag=[0.0],
            propagate=self._propagate,
            step=self._step,
            wanted=wanted,
            diagnose=False,
            workers=workers,
            progress=report,
        )
        batch = estimates((), self._names, found, self._known)
        each = {name: np.full(1, factor) for name, factor in zip(self._names, factors, strict=True) if factor != 1}
        return replace(batch, factors=each)

    @cached_property
    def _strong(self) -> _core.StrongForm:
        form = self._form()
        assert isinstance(form, _core.StrongForm)  # noqa: S101 - weak form is asked nothing of parts
        return form

    def _of(self, held: Held) -> _core.Motions:
        known: list[Any] = [self._known.get(name) for name in COEFFICIENTS]
        terms: list[Any] = [one.name for one in self._terms]
        return _core.Motions(held.angle, held.torque, known, terms, parts=list(held.spans), samples=self._samples)
