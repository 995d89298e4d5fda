"""Elements that are sums of functions: windows tell noise and test function, then curves over the whole record take their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._advice import found_expansion, words_of_expansions
from tvident._derivatives import rates_of_channel
from tvident._equation import COEFFICIENTS
from tvident._expansion import (
    MORE_THAN_NOISE,
    AlignedSamples,
    Curves,
    ExpandedRecord,
    RecordPart,
    SizeSearch,
    part_of,
    rates_of,
    spread_of,
    with_least_noise,
)
from tvident._merged.elements import Element
from tvident._merged.predicted import Equations, TrialArrays
from tvident._results import ExpandedFit, ExpandedParameter, WindowsBeside, Words
from tvident._status import DOUBTFUL, Status

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class FoundElement:
    """An element as the core would return it: values and standard errors at the samples, or one of a constant."""

    element: int
    kind: str
    values: Array
    stderr: Array
    test: _core.ConstancyTest | None
    spread: Sequence[_core.Estimate]


@dataclass(frozen=True)
class ExpandedEquations:
    """Equations that share unknowns, some of them sums of functions, and what windows in their place found.

    Parameters
    ----------
    equations : Equations
    windows : MergedIdentification
        Of the core, at every sample.
    period : float
        Seconds from one sample to the next.
    time : ndarray, shape (samples,)
        Seconds.
    step : int
    units : mapping of str to str
    phase : ndarray, shape (samples,), optional
        In the place of time, from 0 to 1, where trials are aligned on one.
    """

    equations: Equations
    windows: _core.MergedIdentification
    period: float
    time: Array
    step: int
    units: dict[str, str]
    phase: Array | None = None

    def found(self) -> FoundExpanded | None:
        """Return what takes the place of windows; None where they determine nothing."""
        is_deficient = Status.RANK_DEFICIENT in Status(self.windows.record_status)
        if not self.windows.window_length or (is_deficient and bool(np.all(self.windows.status & Status.INVALID))):
            return None
        noise = with_least_noise(self.windows.noise, self._records, self._start)
        search = SizeSearch(self._records, self._parts, noise, self._known)
        found = search.run(self._start)
        expansions = self.equations.expansions
        unit_of_time = "s" if self.phase is None else ""
        fit = ExpandedFit(search, expansions, self.units, *found, unit_of_time).with_errors_of_residuals()
        return FoundExpanded(self.windows, self.equations, fit, self.time, self.step)

    @property
    def _along(self) -> tuple[Array, float]:
        """What functions of time are functions of, and by how much it grows in a second."""
        return (self.time, 1.0) if self.phase is None else (self.phase, 1 / (self.phase.size * self.period))

    @property
    def _unknown(self) -> list[Element]:
        return [one for one in self.equations.elements if not one.is_known]

    @cached_property
    def _records(self) -> list[ExpandedRecord]:
        """The trials as rows are made of them."""
        return [self._record(trial) for trial in self.equations.trials]

    def _record(self, trial: TrialArrays) -> ExpandedRecord:
        angles, torques, terms = (
            np.zeros((0, np.shape(trial[0])[1])) if one is None else np.asarray(one, np.float64) for one in trial[:3]
        )
        # A number as the core sees it.
        is_angle, is_torque, is_term = (np.abs(one) <= arguments.LARGEST for one in (angles, torques, terms))
        alignment = self._alignment(trial[4])
        usable, samples = is_torque.copy(), angles.shape[1]
        centres = np.ones(samples, np.bool_) if trial[3] is None else np.asarray(trial[3])
        if alignment is not None:
            usable &= alignment.is_inside
            centres = centres & alignment.is_centre
        for element in self.equations.elements:
            channels = self.equations.expansions[element.name].channels if element.expansion else ()
            for equation, of, channel, _ in element.entries:
                usable[equation] &= is_term[channel] if of is None else is_angle[channel]
                for one in channels:
                    there = np.isfinite(one)
                    usable[equation] &= there[:samples] if alignment is None else there[alignment.nearest]
        return ExpandedRecord(
            angles=np.where(is_angle, angles, 0.0),
            torques=np.where(is_torque, torques, 0.0),
            usable=usable,
            centres=centres,
            period=self.period,
            half=self.windows.window_length // 2,
            exponent=self.windows.exponent,
            terms=list(np.where(is_term, terms, 0.0)),
            spread=spread_of(trial[5]),
            alignment=alignment,
        )

    def _alignment(self, positions: Array | None) -> AlignedSamples | None:
        """Return where samples of a trial lie along the curves; trials go on into the next cycle where all functions do."""
        if positions is None:
            return None
        expansions = self.equations.expansions.values()
        is_periodic = all(
            one.is_of_time and one.family == "fourier" and one.given_limits == ((0.0, 1.0),) for one in expansions
        )
        return AlignedSamples(positions, self.time.size, is_periodic)

    @cached_property
    def _parts(self) -> list[RecordPart]:
        """The unknowns, still without sizes."""
        found = []
        for one in self._unknown:
            places, expansion = one.places, self.equations.expansions.get(one.name)
            if expansion is None:
                found.append(RecordPart(one.name, places))
            else:
                found.append(part_of(one.name, places, expansion, self._along, partial(rates_of_channel, self.period)))
        return found

    @property
    def _known(self) -> Curves:
        """Elements that are known."""
        nothing = np.zeros(self.time.size)
        known = [one for one in self.equations.elements if one.is_known and one.number]
        return [(one.places, [np.full(self.time.size, one.number), *[nothing] * rates_of(one.places)]) for one in known]

    @property
    def _start(self) -> Curves:
        """The elements as windows have them; without their slopes, which are noise."""
        found = []
        names = [one.name for one in self.equations.elements]
        by_name = {names[one.element]: one.values for one in self.windows.elements}
        for one in self._unknown:
            value = np.broadcast_to(by_name[one.name], self.time.size)
            there = np.isfinite(value)
            middle = float(np.median(value[there])) if there.any() else 0.0
            follows = one.of == "stiffness" or one.of not in COEFFICIENTS
            level = np.where(there, value, middle) if follows else np.full(value.shape, middle)
            found.append((one.places, [level, *[np.zeros(value.shape)] * rates_of(one.places)]))
        return [*found, *self._known]


class FoundExpanded:
    """What takes the place of windows, as the core would return it; what is not here windows found.

    Parameters
    ----------
    windows : MergedIdentification
        Of the core, at every sample.
    equations : Equations
    fit : ExpandedFit
    time : ndarray, shape (samples,)
        Seconds.
    step : int
    """

    def __init__(
        self, windows: _core.MergedIdentification, equations: Equations, fit: ExpandedFit, time: Array, step: int
    ) -> None:
        self.windows, self._equations, self._fit, self._time = windows, equations, fit, time
        self._step = slice(None, None, step)
        self._names = [one.name for one in equations.elements]
        self._of_windows = {self._names[one.element]: one for one in windows.elements}
        values, errors = {}, {}
        for one, value, error in fit.values_and_errors(slice(None)):
            values[one.name], errors[one.name] = value, error
        self._along, self._beside = (
            {name: np.broadcast_to(one, time.size) for name, one in each.items()} for each in (values, errors)
        )
        self.status = fit.without_untold(self._along, self._beside, windows.status, slice(None))[self._step]
        count = self.status.size
        constants = [name for name in values if name not in fit.expansions]
        self._values = {name: values[name] if name in constants else self._along[name][self._step] for name in values}
        self._errors = {name: errors[name] if name in constants else self._beside[name][self._step] for name in values}
        self.jumps: list[int] = []
        self.lengths: list[_core.TriedLength] = []
        # Nothing is windowed.
        self.regression_window = 0
        self.prediction_error = fit.ratio
        self.condition = fit.condition
        self.residual = np.full(count, np.sqrt(fit.ratio))
        self.window_length, self.exponent = windows.window_length, windows.exponent
        self.noise, self.colours, self.misfit = windows.noise, windows.colours, windows.misfit
        self.scan, self.defects = windows.scan, windows.defects
        self.late, self.lacking, self.terms = windows.late, windows.lacking, windows.terms

    @property
    def elements(self) -> list[FoundElement]:
        """All unknowns."""
        found = []
        for name, values in self._values.items():
            kind, of_windows = "expanded" if name in self._fit.expansions else "constant", self._of_windows[name]
            # An element of which windows of time say that it changes may be a function of a channel.
            test = of_windows.test if kind == "constant" and self._windows_explain else None
            place = self._names.index(name)
            found.append(FoundElement(place, kind, values, self._errors[name], test, of_windows.spread))
        return found

    @property
    def _windows_explain(self) -> bool:
        """Whether windows leave no more than noise, or functions leave more as well; if neither, tests of parts say what windows miss."""
        return self.windows.prediction_error <= MORE_THAN_NOISE or self._fit.ratio > MORE_THAN_NOISE

    @property
    def constants(self) -> list[int]:
        """Elements with one value."""
        return [self._names.index(name) for name in self._values if name not in self._fit.expansions]

    @property
    def covariance(self) -> list[float]:
        """That of the constants, row by row."""
        names = [self._names[place] for place in self.constants]
        pairs = {frozenset(pair): values[0] for pair, values in self._fit.covariances(names).items()}
        return [
            float(self._errors[one][0] ** 2 if one == other else pairs[frozenset((one, other))])
            for one in names
            for other in names
        ]

    @property
    def covariances(self) -> dict[tuple[int, int], Array]:
        """Those of pairs with a sum of functions."""
        found = {}
        for (one, other), values in self._fit.covariances(list(self._values)).items():
            if one in self._fit.expansions or other in self._fit.expansions:
                found[self._names.index(one), self._names.index(other)] = values[self._step]
        return found

    @property
    def curves(self) -> dict[str, ExpandedParameter]:
        """Every sum of functions as a curve."""
        return self._fit.curves

    @property
    def record_status(self) -> int:
        """Flags of the record."""
        flags = self._fit.flags(Status(self.windows.record_status)) | self._doubts
        tests = [one.test for one in self.elements if one.test is not None]
        if any(one.is_contradicted for one in self._told) or any(one.probability < _core.NO_CHANCE for one in tests):
            flags |= Status.KIND_CONTRADICTED
        return int(flags)

    @property
    def _doubts(self) -> Status:
        """What windows of time say against functions of time in their place."""
        return self._fit.doubts(Status(self.windows.record_status))

    @cached_property
    def _told(self) -> list[Any]:
        """What was found of every sum of functions, beside windows in its place."""
        return [
            found_expansion(
                one,
                self._fit.expansions[name],
                self._windows_of(name),
                (self._along[name], self._beside[name]),
                self._time,
            )
            for name, one in self.curves.items()
        ]

    def _windows_of(self, name: str) -> WindowsBeside | None:
        found = self._of_windows[name]
        if found.kind != "windowed":
            return None
        samples, length = self._time.size, self.windows.window_length
        values, errors = (np.broadcast_to(one, samples) for one in (found.values, found.stderr))
        # In gaps and at the ends windows are carried on.
        doubts = DOUBTFUL | int(Status.GAP | Status.EDGE)
        trusted = (self.windows.status & doubts == 0) & np.isfinite(values)
        rows = self.windows.regression_window + length
        return WindowsBeside(values, errors, trusted, rows, length // 2, list(self.windows.jumps))

    @property
    def words(self) -> Words:
        """How sizes were chosen, and whether windows agree."""
        changing = [
            name
            for name, one in self._of_windows.items()
            if name not in self._fit.expansions and one.kind == "windowed"
        ]
        fitted = self._fit.fitted
        return words_of_expansions(
            self._told,
            self._fit.independent,
            self._fit.ratio,
            changing,
            doubted=bool(self._doubts),
            determined=bool(np.isfinite(fitted.condition)),
        )
