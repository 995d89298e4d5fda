"""One call of ``identify``: data and settings, the call of the core, the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives import quantisation_step
from tvident._equation import COEFFICIENTS, Kind, Unknown, all_terms, parameter
from tvident._identify.alignment_errors import with_errors_of_alignment
from tvident._identify.batch import estimates, of_windows, with_inner
from tvident._identify.channels import constants_of
from tvident._identify.columns import Columns, Range, fixed, secant
from tvident._identify.criterion import criterion_of
from tvident._identify.data import Data, cut
from tvident._identify.improved import Improvement, TriedInWeakForm, is_to_be_tried, is_told_by_weak_form, of_one
from tvident._identify.lacking import lacking_terms
from tvident._identify.methods import SHORTEST_TEST_FUNCTION, StrongForm, exponent_of
from tvident._identify.polynomials import Polynomials, odd_window
from tvident._identify.searched import Searched, factor_of, search
from tvident._identify.settings import Request, plain, resolve
from tvident._identify.told import Told
from tvident._identify.used import as_used
from tvident._identify.written import lag_that_was_found, tested_in_order
from tvident._results import Estimates, Identification, Recorded, Scan, Words, chosen, of_records, scan_of, settings_of

Numbers = npt.NDArray[np.float64]


class Task:
    """One call.

    Parameters
    ----------
    data : Data
    request : Request
    """

    def __init__(self, data: Data, request: Request) -> None:
        self._data = data
        self._request = request
        self._quantisation = quantisation_step(data.angles, request.quantisation)
        self._polynomials = Polynomials(request.form, data.period, data.time.size, self._quantisation)
        shape = data.angles.shape
        self._parameters = {name: parameter(name, value, shape) for name, value in request.parameters.items()}
        kinds: dict[str, Kind] = {name: value for name, value in self._parameters.items() if isinstance(value, str)}
        usual = request.kinds_of_terms(kinds.values(), has_instrument=data.instruments is not None)
        self._terms = all_terms(request.terms, *usual)
        self._unknowns = [Unknown(name, kind) for name, kind in kinds.items()] + self._terms
        if not self._unknowns:
            raise ValueError(
                "at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one"
            )
        self._names = [one.name for one in self._unknowns]
        self.inner = [one for term in self._terms for one in term.inner]
        self._known = {name: value for name, value in self._parameters.items() if not isinstance(value, str)}

    def run(self, progress: arguments.Progress, *, diagnose: bool = True) -> Identification:
        """Identify every record, and look for what may be missing in the equation."""
        with arguments.reporter(progress, "identification") as report:
            searched = self._searched(report)
            found = self.found(searched.values, slopes=diagnose, diagnose=diagnose, report=report)
        return self._result(found, searched)

    def estimates(self, report: Callable[[int, int], object] | None = None, *, diagnose: bool = False) -> Estimates:
        """Identify every record, and return its numbers alone: settings, words and ways to go on cost as much as a thousand samples."""
        searched = self._searched(report)
        found = self.found(searched.values, slopes=diagnose, diagnose=diagnose, report=report)
        return self._numbers(found, searched)[1].doubted()

    def found(
        self,
        inner: Mapping[str, Numbers],
        *,
        slopes: bool = False,
        factors: Mapping[str, Sequence[Numbers]] | None = None,
        diagnose: bool = False,
        report: Callable[[int, int], object] | None = None,
    ) -> Sequence[_core.Identification]:
        """Identify with given inner parameters of terms, as unknowns too where slopes are wanted.

        Parameters
        ----------
        inner : mapping of str to ndarray, shape (records,)
        slopes : bool
            By how much inner parameters are to be moved is unknown, too: it is zero where they are best, and its standard error is theirs.
        factors : mapping of str to sequence of ndarray
            Of the terms that have inner parameters, about; found first where they are not given.
        diagnose : bool
            Look for what may be missing.
        report : callable, optional
        """
        data, request = self._data, self._request
        moving = []
        if slopes and self.inner:
            if factors is None:
                without = self.found(inner)
                factors = {one.term: factor_of(without, self.place_of(one.term)) for one in self.inner}
            moving = self._slopes(inner, factors)
        motions = self._motions([*self.columns.samples(inner, repeated=not diagnose), *moving])
        return _core.identify(
            motions,
            [*(one.kind for one in self._unknowns), *("constant" for _ in moving)],
            self._form(),
            delta=data.period,
            lag=self._lags(),
            angle_zero=self._angle_zeros(),
            quantisation=request.quantisation,
            masks=data.masks,
            weights=data.weights_of_core(strong=isinstance(request.form, StrongForm)),
            propagate=data.propagate,
            step=data.step,
            wanted=data.wanted,
            diagnose=diagnose,
            instrument=data.instruments,
            workers=data.workers,
            progress=report,
        )

    def place_of(self, name: str) -> int:
        """Return the place of an unknown among those that were found, inner parameters last."""
        return [*self._names, *(one.full_name for one in self.inner)].index(name)

    @cached_property
    def ranges(self) -> dict[str, Range]:
        """Where inner parameters are searched."""
        return {one.full_name: self.columns.range_of(one) for one in self.inner}

    def frozen(self, found: Sequence[_core.Identification], inner: Mapping[str, Numbers]) -> Task:
        """Return the same task with what was chosen; where something is windowed in windows of one length, which cost less."""
        settings = plain(self._settings(found, Searched(inner)))
        if not isinstance(self._request.form, StrongForm):
            settings["averaging"] &= all(one.kind == "constant" for record in found for one in record.unknowns)
        return self._replayed(settings, self._data)

    def without(self, term: str) -> Task | None:
        """Return the same task without a term; None where nothing would be left."""
        if self._names == [term]:
            return None
        rest = [(one.own or one.name, one.kind) for one in self._terms if one.name != term]
        return Task(self._data, replace(self._request, terms=rest))

    def criterion(self, found: Sequence[_core.Identification], more: int) -> Numbers:
        """Return the criterion of every record, with so many parameters more than the core knows of."""
        linear = self._request.form.variation != "constant"
        samples = np.isfinite(self._data.angles).sum(axis=-1).ravel()
        scores = [criterion_of(one, int(n), more, linear=linear) for one, n in zip(found, samples, strict=True)]
        return np.array(scores)

    def _searched(self, report: Callable[[int, int], object] | None) -> Searched:
        """Return inner parameters: those of an earlier result, or what a search finds."""
        request, records = self._request, self._data.records
        names = [one.full_name for one in self.inner]
        if not names or not records:
            return Searched({name: np.zeros(records) for name in names})
        if not all(name in request.inner for name in names):
            return search(self, report)

        def each(name: str, value: Any) -> Numbers:
            values = np.array(value if isinstance(value, list | tuple) else [value] * records)
            if values.size != records:
                raise ValueError(
                    f"{name} must be one number, or one for each of the {records} records; got {values.size}; "
                    "give settings of a result with as many records"
                )
            return values

        needed = {one.term: each(one.term, request.needed.get(one.term, True)).astype(bool) for one in self.inner}
        return Searched({name: each(name, request.inner[name]).astype(np.float64) for name in names}, needed=needed)

    def _slopes(self, inner: Mapping[str, Numbers], factors: Mapping[str, Sequence[Numbers]]) -> list[Numbers]:
        """Return what a unit more of each inner parameter does to the torque; nothing if one of them does nothing anywhere."""
        slopes = []
        for one in self.inner:
            slope = self.columns.slope(one, secant(self.ranges[one.full_name], inner[one.full_name]), inner)
            for record, factor in enumerate(factors[one.term]):
                slope[record] *= np.repeat(factor, self._data.step)[: slope.shape[1]] if factor.size > 1 else factor
            if not np.any(np.nan_to_num(slope)):
                return []
            slopes.append(slope.reshape(self._data.angles.shape))
        return slopes

    # What leaves the range of doubles here is NaN or next to zero, whatever NumPy is told to do about it.
    @np.errstate(all="ignore")
    def _numbers(self, found: Sequence[_core.Identification], searched: Searched) -> tuple[list[str], Told]:
        """Return the names of what the core found in every record, and the numbers by name with what is to be told of them."""
        data = self._data
        known = {name: cut(value, slice(None, None, data.step)) for name, value in self._known.items()}
        inner = [one.full_name for one in self.inner]
        names = [*self._names, *(inner if found and len(found[0].unknowns) > len(self._names) else [])]
        batch = estimates(data.batch, names, found, known)
        if inner:
            unknown = {name: one.unknown_error for name, one in self.ranges.items()}
            needed = {one.full_name: searched.needed[one.term] for one in self.inner}
            batch = with_inner(batch, searched.values, unknown, needed, data.time[:: data.step].size)
        if data.labels is not None:
            batch = replace(batch, labels=data.labels.at(slice(None, None, data.step)))
        constants = {**batch.constants, **constants_of(data.motion, data.batch)}
        batch = replace(batch, constants=constants, units=data.units)
        if data.moved:
            settings = plain(self._settings(found, searched))
            torques = (data.torques, *(data.torques + change() for change in data.moved))
            again = [self._replayed(settings, replace(data, torques=one)).estimates() for one in torques]
            batch = with_errors_of_alignment(batch, again[0], again[1:])
        used = as_used(data, found)
        lacking = lacking_terms(used, self._request, self._unknowns, found, self._polynomials, self._known)
        return names, Told(used, self._request, self._unknowns, found, batch, lacking)

    def _result(self, found: Sequence[_core.Identification], searched: Searched) -> Identification:
        """Return the result of what the core found in every record."""
        data, settings = self._data, self._settings(found, searched)
        names, told = self._numbers(found, searched)
        searches = searched.told(self.inner, self.ranges, told.batch, self.columns.samples_of_fading)
        words = partial(told.words, names, searches, settings)
        batch = told.doubted()
        jumps = tuple(tuple(data.time[one.jumps].tolist()) for one in found)
        return Identification(
            batch,
            time=data.time[:: data.step],
            terms=[term.name for term in self._terms],
            jumps=jumps if data.batch else jumps[0],
            words=words,
            settings=plain(settings),
            recorded=replace(self._recorded(plain(settings), batch, told.data), improve=self._improve(found)),
        )

    def _improve(self, found: Sequence[_core.Identification]) -> Callable[[Any, Words], Words] | None:
        """Return what puts first into words which change of the equation leads to the answer; None where nothing is to be tried."""
        is_strong = is_told_by_weak_form(self._data, self._request)
        if self.inner or not (is_strong or is_to_be_tried(self._data, self._request, found)):
            return None
        given = self._request.asked(self._request.parameters) | self._known

        def run(request: Request, data: Data, *, diagnose: bool) -> Identification:
            return Task(data, request).run(progress=None, diagnose=diagnose)

        if is_strong:
            return TriedInWeakForm(self._data, self._request, given, self._terms, run).words
        return Improvement(replace(self._data, moved=()), self._request, given, self._terms, run, found[0]).words

    def _recorded(self, settings: dict[str, Any], found: Estimates, used: Data) -> Recorded:
        """Return the records as they were used, which can be identified once more, all or some of them."""
        data = self._data

        def part(place: Any) -> Recorded:
            some_data = data.of(place)
            some_used = replace(some_data, angles=used.angles[place], torques=used.torques[place])
            kinds = {name: np.asarray(kind)[place] for name, kind in found.kinds.items()}
            own = settings_of(settings, chosen(place, data.batch), kinds, alone=some_data.angles.ndim == 1)
            known = {name: value if isinstance(value, float) else value[place] for name, value in self._known.items()}
            request = replace(self._request, parameters={**self._request.parameters, **known})
            one, task = of_records(found, place), Task(some_data, request)
            recorded = Task(some_data, replace(request, by_record={}, lag=0.0))._recorded(own, one, some_used)  # noqa: SLF001 - of this class
            return replace(recorded, improve=of_one(some_data, request, one.record_status, task.run, task._improve))

        inner = {name: np.ravel(value) for name, value in settings["inner"].items()}
        is_strong = isinstance(self._request.form, StrongForm)
        return Recorded(
            used.angles,
            used.torques,
            (data.angles, data.torques),
            own={term.name: fixed(term.own, term, inner) for term in self._terms if term.own is not None},
            again=partial(self._again, settings),
            scans=partial(self._scans, settings) if is_strong and data.instruments is None else None,
            again_in=partial(self._again, settings) if data.is_plain else None,
            part=part if data.batch else None,
            mask=data.mask,
            beside=[*data.beside, *(one for one in self._known.values() if not isinstance(one, float))],
        )

    def _scans(self, settings: dict[str, Any]) -> tuple[Scan, ...]:
        """Compare windows of all lengths, with the other choices that were made."""
        return self._replayed(settings, self._data).scans()

    def scans(self) -> tuple[Scan, ...]:
        """Compare windows of all lengths in strong form."""
        form, data = self._form(), self._data
        assert isinstance(form, _core.StrongForm)  # noqa: S101 - weak form compares test functions of all widths while it identifies
        motions = self._motions(self.columns.samples(self._searched(None).values), scanned=True)
        kinds, lags = [one.kind for one in self._unknowns], [late or 0.0 for late in self._lags()]
        weights = data.weights_of_core(strong=True)
        found = form.scan(motions, kinds, lag=lags, masks=data.masks, weights=weights, workers=data.workers)
        return tuple(scan_of(one, self._names) for one in found)

    def _again(
        self,
        settings: dict[str, Any],
        angles: npt.NDArray[np.number],
        some: slice | None = None,
        known: Mapping[str, Any] | None = None,
    ) -> Identification:
        """Identify another angle with what was chosen, or that of a stretch with what else is known; its missing values are left out."""
        data, given = self._data, None
        if some is not None:
            data = data.stretch(some)
            given = {name: cut(value, some) for name, value in {**self._known, **(known or {})}.items()}
        task = self._replayed(settings, replace(data, angles=angles, propagate=False, step=1), given)
        return task.run(progress=None, diagnose=False)

    def _replayed(self, settings: dict[str, Any], data: Data, known: Mapping[str, Any] | None = None) -> Task:
        """Return the task of other data with what was chosen, and what is known of them."""
        given = dict(known or {name: value for name, value in self._known.items() if not isinstance(value, float)})
        if settings["own_terms"]:
            given["terms"] = [(term.own or term.name, settings["kinds"][term.name]) for term in self._terms]
        has_instrument = self._data.instruments is not None
        request = resolve(
            "auto", given, settings, settings["sample_rate"], data.motion.names, has_instrument=has_instrument
        )
        return Task(replace(data, moved=()), request)

    @cached_property
    def columns(self) -> Columns:
        """The terms, evaluated with the polynomials of the strong form, or with short ones."""
        data, weak = self._data, not isinstance(self._request.form, StrongForm)
        return Columns(self._terms, data.angles, data.time, data.period, self._polynomials, weak, data.workers)

    def _form(self) -> _core.WeakForm | _core.StrongForm:
        """Return the form as the core has it."""
        form = self._request.form
        if isinstance(form, StrongForm):
            core_plan = self._polynomials()
            rows = arguments.window_length("regression_window", form.regression_window, self._data.period, odd=False)
            if any(
                one.kind in {"windowed", "varying"} or (one.name, one.kind) == ("stiffness", "auto")
                for one in self._unknowns
            ):
                self._check_rows(rows)
            linear = form.variation == "linear"
            return _core.StrongForm(core_plan, rows, filter_torque=form.filter_torque, linear=linear)
        lengths = [
            None if value == "auto" else self._length("window_length", value, least=SHORTEST_TEST_FUNCTION)
            for value in self._each("window_length")
        ]
        rows_of = [None if value == "auto" else self._rows(value) for value in self._each("regression_window")]
        exponents = [None if value == "auto" else int(exponent_of(value)) for value in self._each("exponent")]
        request, records = self._request, self._data.records
        return _core.WeakForm(
            lengths,
            exponents,
            rows_of,
            averaging=bool(form.averaging),
            linear=form.variation != "constant",
            shown_noise=request.noise_of_equations(records),
            tested=[self._names.index(name) for name in request.tested if name in self._names],
            near=request.windows_near if len(request.windows_near) == records else None,
            width_from=request.width_from if len(request.width_from) == records else None,
            found_lag=request.lag_untold if "lag" in request.kept else None,
        )

    def _each(self, name: str) -> Sequence[Any]:
        return self._request.each(name, self._data.records)

    def _length(self, name: str, value: int | str, *, least: int) -> int:
        """Return the samples of an odd window."""
        return odd_window(name, value, self._data.period, self._data.time.size, least=least)

    def _rows(self, value: int | str) -> int:
        """Return the samples of a regression window."""
        rows = arguments.window_length("regression_window", value, self._data.period, odd=False)
        self._check_rows(rows)
        return rows

    def _check_rows(self, rows: int) -> None:
        arguments.check_window("regression_window", rows, self._data.time.size, least=len(self._unknowns) + 1)

    def _lags(self) -> list[float | None]:
        """Return by how many samples the torque of every record is late; None where that is to be found."""
        data, samples = self._data, self._data.time.size
        lags = list(self._each("lag"))
        for late in lags:
            if late != "auto" and abs(late) >= samples * data.period:
                raise ValueError(
                    f"lag must be shorter than the record of {samples * data.period:.6g} s; got {late:.6g} s; "
                    "give it in seconds, or align the channels"
                )
        if len(earlier := self._request.lag_samples or ()) == data.records:
            return list(earlier)
        return [None if late == "auto" else late / data.period for late in lags]

    def _angle_zeros(self) -> list[float | None]:
        """Return about which angle the spring of every record is relaxed; None where the record decides."""
        zeros = self._request.angle_zero
        return list(zeros) if zeros is not None and len(zeros) == self._data.records else [None] * self._data.records

    def _motions(self, columns: list[npt.NDArray[np.number] | str], *, scanned: bool = False) -> _core.Motions:
        known = [self._known.get(name) for name in COEFFICIENTS]
        data, is_weak = self._data, not isinstance(self._request.form, StrongForm)
        return _core.Motions(data.angles, data.torques, known, columns, **data.measured(on_grid=is_weak or scanned))

    def _settings(self, found: Sequence[_core.Identification], searched: Searched) -> dict[str, Any]:
        """Return inputs and choices."""
        request, data = self._request, self._data

        def by_record(values: Sequence[Any]) -> Any:
            return list(values) if data.batch else values[0]

        used = {one.name: getattr(request.form, one.name) for one in fields(request.form)}
        names = ("window_length", "exponent", "regression_window")
        # Where nothing could be determined nothing was chosen: what was asked for stands.
        used |= {
            name: by_record([getattr(one, name) or asked for one, asked in zip(found, self._each(name), strict=True)])
            for name in names
            if name in used
        }
        chosen: list[str] = []
        lag: dict[str, Any] = {"lag": by_record(self._each("lag"))}
        if isinstance(request.form, StrongForm):
            used |= of_windows(self._names, found)
            lag = {"lag": request.lag}
        else:
            chosen = [one for one in names if "auto" in self._each(one) or one in request.kept]
            used["width_from"] = by_record([one.width_from for one in found])
            used["windows_near"] = by_record([one.near for one in found])
            used["tested"] = tested_in_order(self._unknowns, found, request)
            used["angle_zero"] = by_record([0.0 if one.angle_zero is None else one.angle_zero.value for one in found])
            noises = [one.shown_noise for one in found if one.shown_noise is not None]  # infinite of a channel of NaN
            used["shown_noise"] = [one if one < np.inf else 0.0 for one in noises] or None
            used["variation"] = request.form.variation.replace("auto", "linear")
            if request.lag == "auto" or "lag" in request.kept:
                chosen.append("lag")
                lag |= lag_that_was_found(request, found, by_record, data.period)
        kinds = dict.fromkeys(COEFFICIENTS, "known")
        for place, unknown in enumerate(self._unknowns):
            turned_out = {one.unknowns[place].kind for one in found}
            # What is constant in some records and changes in others stays to be tested in each.
            kinds[unknown.name] = turned_out.pop() if len(turned_out) == 1 else unknown.kind
        return {
            "method": request.name,
            "form": "strong" if isinstance(request.form, StrongForm) else "weak",
            **used,
            **lag,
            "quantisation": self._quantisation,
            "period": request.period,
            "loss": "squares" if not any(data.clipped or ()) else "huber",
            "kinds": kinds,
            "terms": [[term.name, kinds[term.name]] for term in self._terms],
            "inner": {name: by_record(value.tolist()) for name, value in searched.values.items()},
            "needed": {name: by_record(value.tolist()) for name, value in searched.needed.items()},
            "own_terms": [term.name for term in self._terms if term.own is not None],
            "known": {name: value if isinstance(value, float) else None for name, value in self._known.items()},
            **data.settings,
            "chosen": chosen,
        }
