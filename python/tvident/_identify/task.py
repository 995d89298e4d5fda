"""One call of ``identify``: data and settings, the call of the core, the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._advice import Explained, ExplainedStrong, Plausible, words_with_instrument
from tvident._derivatives import SHORTEST_WINDOW, plan, quantisation_step
from tvident._equation import COEFFICIENTS, LINEAR_UNITS, UNITS, Kind, Unknown, all_terms, parameter
from tvident._identify.batch import estimates
from tvident._identify.methods import SHORTEST_TEST_FUNCTION, StrongForm, exponent_of
from tvident._identify.settings import Request, plain, resolve
from tvident._results import Estimates, Identification, Recorded, Words, chosen, of_batch, of_records, settings_of
from tvident._status import Status
from tvident._units import ROTARY, Axis

_WINDOW_OF_TERMS = 51
"""Samples of the polynomials that terms of one's own get angle and velocity from in weak form."""


@dataclass(frozen=True)
class Data:
    r"""Records, and what is to be done with them.

    Parameters
    ----------
    angles, torques : ndarray, shape (\\*, n)
    instruments : ndarray, shape (\\*, n), optional
    time : ndarray, shape (n,)
    period : float
        Seconds from one sample to the next.
    mask : ndarray of bool, shape (\\*, n), optional
    propagate : bool
        Missing values make windows that hold one missing.
    step : int
        Every how many samples a result is wanted.
    workers : int, optional
    doubts : sequence of (int, str)
        What cannot be known of the channels, and of which record.
    labels : Labels, optional
        What the angle came with: an index, coordinates.
    axis : Axis, optional
        What the channels were measured in.
    """

    angles: npt.NDArray[np.number]
    torques: npt.NDArray[np.number]
    instruments: npt.NDArray[np.number] | None
    time: npt.NDArray[np.float64]
    period: float
    mask: npt.NDArray[np.bool_] | None
    propagate: bool
    step: int
    workers: int | None
    doubts: Sequence[tuple[int, str]] = ()
    labels: arguments.Labels | None = None
    axis: Axis = field(default_factory=Axis)

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch; empty for a single record."""
        return self.angles.shape[:-1]

    @property
    def masks(self) -> list[npt.NDArray[np.bool_]] | None:
        """The mask of every record, or None without one."""
        if self.mask is None:
            return None
        return [np.ascontiguousarray(one) for one in self.mask.reshape(-1, self.time.size)]

    @property
    def records(self) -> int:
        """How many records there are."""
        return int(np.prod(self.batch, dtype=int))


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
        shape = data.angles.shape
        self._parameters = {name: parameter(name, value, shape) for name, value in request.parameters.items()}
        kinds: dict[str, Kind] = {name: value for name, value in self._parameters.items() if isinstance(value, str)}
        is_paper = data.instruments is None and all(kind == "windowed" for kind in kinds.values())
        default: Kind = "windowed" if is_paper else "constant"
        self._terms = all_terms(request.terms, default)
        self._unknowns = [Unknown(name, kind) for name, kind in kinds.items()] + self._terms
        if not self._unknowns:
            raise ValueError(
                "at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one"
            )
        self._names = [one.name for one in self._unknowns]
        self._known = {name: value for name, value in self._parameters.items() if not isinstance(value, str)}

    @property
    def _units(self) -> Mapping[str, str]:
        """Units of results."""
        return UNITS if self._data.axis.system is ROTARY else LINEAR_UNITS

    def run(self, progress: arguments.Progress, *, diagnose: bool = True) -> Identification:
        """Identify every record, and look for what may be missing in the equation."""
        data, request = self._data, self._request
        form, core_plan = self._form()
        with arguments.reporter(progress, "identification") as report:
            found = _core.identify(
                self._motions(core_plan),
                [one.kind for one in self._unknowns],
                form,
                delta=data.period,
                lag=self._lags(),
                quantisation=request.quantisation,
                masks=data.masks,
                propagate=data.propagate,
                step=data.step,
                diagnose=diagnose,
                instrument=data.instruments,
                workers=data.workers,
                progress=report,
            )
        return self._result(found)

    # What leaves the range of doubles here is NaN or next to zero, whatever NumPy is told to do about it.
    @np.errstate(all="ignore")
    def _result(self, found: Sequence[_core.Identification]) -> Identification:
        """Return the result of what the core found in every record."""
        data, request = self._data, self._request
        known = {
            name: value if isinstance(value, float) else value[..., :: data.step] for name, value in self._known.items()
        }
        batch = estimates(data.batch, self._names, found, known)
        if data.labels is not None:
            batch = replace(batch, labels=data.labels.at(slice(None, None, data.step)))
        settings = self._settings(found)
        explain: Any = self._words_of_strong_form if isinstance(request.form, StrongForm) else self._words_of_weak_form
        explain = self._words_with_instrument if data.instruments is not None else explain
        batch = replace(batch, units=self._units)
        words: Any = partial(self._with_plausibility, explain(found, batch, settings), batch)
        if data.doubts:
            batch, words = self._doubted(batch, words if isinstance(words, Words) else words())
        jumps = tuple(tuple(data.time[one.jumps].tolist()) for one in found)
        return Identification(
            batch,
            time=data.time[:: data.step],
            terms=[term.name for term in self._terms],
            jumps=jumps if data.batch else jumps[0],
            words=words,
            settings=plain(settings),
            recorded=self._recorded(plain(settings), batch),
        )

    def _recorded(self, settings: dict[str, Any], found: Estimates) -> Recorded:
        """Return the records, which can be identified once more, all or some of them."""
        data = self._data

        def part(place: Any) -> Recorded:
            def some(array: Any) -> Any:
                return None if array is None else array[place]

            some_data = replace(
                data,
                angles=data.angles[place],
                torques=data.torques[place],
                instruments=some(data.instruments),
                mask=some(data.mask),
                doubts=(),
                labels=None,
            )
            kinds = {name: np.asarray(kind)[place] for name, kind in found.kinds.items()}
            alone = some_data.angles.ndim == 1
            own = settings_of(settings, chosen(place, data.batch), kinds, alone=alone)
            known = {name: value if isinstance(value, float) else value[place] for name, value in self._known.items()}
            request = replace(self._request, by_record={}, parameters={**self._request.parameters, **known}, lag=0.0)
            return Task(some_data, request)._recorded(own, of_records(found, place))  # noqa: SLF001 - of this class

        return Recorded(
            data.angles,
            data.torques,
            own={term.name: term.own for term in self._terms if term.own is not None},
            again=partial(self._again, settings),
            part=part if data.batch else None,
        )

    def _doubted(self, batch: Estimates, words: Words) -> tuple[Estimates, Words]:
        """Return estimates that are flagged where a channel leaves something open, and words that say what."""
        data = self._data
        flags = np.zeros(data.records, np.uint16)
        flags[[record for record, _ in data.doubts]] = Status.CHANNEL_SUSPECTED
        more: Any = flags.reshape(data.batch) if data.batch else Status(int(flags[0]))
        lines = [f"record {record}: {line}" if data.batch else line for record, line in data.doubts]
        flagged = replace(batch, record_status=batch.record_status | more)
        each = list(words.each)
        for record, line in data.doubts if each else ():
            each[record] = replace(each[record], advice=(line, *each[record].advice))
        return flagged, Words(words.reasons, (*lines, *words.advice), tuple(each))

    def _again(self, settings: dict[str, Any], angles: npt.NDArray[np.number]) -> Identification:
        """Identify another angle with what was chosen; its missing values are left out."""
        given: dict[str, Any] = {name: value for name, value in self._known.items() if not isinstance(value, float)}
        if settings["own_terms"]:
            given["terms"] = [(term.own or term.name, settings["kinds"][term.name]) for term in self._terms]
        has_instrument = self._data.instruments is not None
        request = resolve("auto", given, settings, settings["sample_rate"], has_instrument=has_instrument)
        return Task(replace(self._data, angles=angles, propagate=False, step=1), request).run(
            progress=None, diagnose=False
        )

    def _form(self) -> tuple[_core.WeakForm | _core.StrongForm, _core.LocalPolynomials | None]:
        """Return the form as the core has it, and the polynomials that terms of the user's own need."""
        form, own = self._request.form, any(term.own is not None for term in self._terms)
        samples = self._data.time.size
        if isinstance(form, StrongForm):
            length = self._length("window_length", form.window_length, least=SHORTEST_WINDOW)
            core_plan = self._plan(length, form)
            rows = arguments.window_length("regression_window", form.regression_window, self._data.period, odd=False)
            if any(
                one.kind in {"windowed", "varying"} or (one.name, one.kind) == ("stiffness", "auto")
                for one in self._unknowns
            ):
                self._check_rows(rows)
            linear = form.variation == "linear"
            return _core.StrongForm(core_plan, rows, filter_torque=form.filter_torque, linear=linear), core_plan
        lengths = [
            None if value == "auto" else self._length("window_length", value, least=SHORTEST_TEST_FUNCTION)
            for value in self._each("window_length")
        ]
        rows_of = [None if value == "auto" else self._rows(value) for value in self._each("regression_window")]
        exponents = [None if value == "auto" else int(exponent_of(value)) for value in self._each("exponent")]
        linear = form.variation != "constant"
        weak = _core.WeakForm(lengths, exponents, rows_of, averaging=bool(form.averaging), linear=linear)
        return weak, self._plan(min(_WINDOW_OF_TERMS, (samples - 1) // 2 * 2 + 1), StrongForm()) if own else None

    def _each(self, name: str) -> Sequence[Any]:
        return self._request.each(name, self._data.records)

    def _length(self, name: str, value: int | str, *, least: int) -> int:
        """Return the samples of an odd window."""
        length = arguments.window_length(name, value, self._data.period, odd=True)
        arguments.check_window(name, length, self._data.time.size, least=least)
        return length

    def _rows(self, value: int | str) -> int:
        """Return the samples of a regression window."""
        rows = arguments.window_length("regression_window", value, self._data.period, odd=False)
        self._check_rows(rows)
        return rows

    def _check_rows(self, rows: int) -> None:
        arguments.check_window("regression_window", rows, self._data.time.size, least=len(self._unknowns) + 1)

    def _plan(self, length: int, form: StrongForm) -> _core.LocalPolynomials:
        return plan(
            length,
            order=None,
            max_order=form.max_order,
            criterion=form.criterion,
            selection=form.selection,
            derivatives=(0, 1, 2),
            delta=self._data.period,
            noise=True,
            quantisation=self._quantisation,
        )

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
        found_earlier = self._request.lag_samples
        if found_earlier is not None and len(found_earlier) == data.records:
            return list(found_earlier)
        return [None if late == "auto" else late / data.period for late in lags]

    def _motions(self, core_plan: _core.LocalPolynomials | None) -> _core.Motions:
        data = self._data
        columns: list[npt.NDArray[np.number] | str] = [term.name for term in self._terms]
        if core_plan is not None and any(term.own is not None for term in self._terms):
            angle, velocity, _ = core_plan.estimate(data.angles, workers=data.workers).derivatives
            columns = [term.own.values(data.time, angle, velocity) if term.own else term.name for term in self._terms]
        known = [self._known.get(name) for name in COEFFICIENTS]
        return _core.Motions(data.angles, data.torques, known, columns)

    def _settings(self, found: Sequence[_core.Identification]) -> dict[str, Any]:
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
            used |= {name: getattr(found[0], name) for name in ("window_length", "regression_window")}
            lag = {"lag": request.lag}
        else:
            chosen = [name for name in names if "auto" in self._each(name)]
            used["variation"] = "constant" if request.form.variation == "constant" else "linear"
            if request.lag == "auto":
                chosen.append("lag")
                lags = [one.lag or (0.0, None) for one in found]
                lag = {
                    "lag": by_record([late * data.period for late, _ in lags]),
                    "lag_stderr": by_record([None if error is None else error * data.period for _, error in lags]),
                    "lag_samples": [late for late, _ in lags],
                }
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
            "instrument": data.instruments is not None,
            "kinds": kinds,
            "terms": [[term.name, kinds[term.name]] for term in self._terms],
            "own_terms": [term.name for term in self._terms if term.own is not None],
            "known": {name: value if isinstance(value, float) else None for name, value in self._known.items()},
            "sample_rate": 1 / data.period,
            "step": data.step,
            "chosen": chosen,
        }

    def _words_with_instrument(
        self, found: Sequence[_core.Identification], batch: Estimates, settings: dict[str, Any]
    ) -> Words:
        del batch, settings
        each = [words_with_instrument(one) for one in found]
        if not self._data.batch:
            return each[0]
        return of_batch(each)

    def _words_of_weak_form(
        self, found: Sequence[_core.Identification], batch: Estimates, settings: dict[str, Any]
    ) -> Words:
        del batch
        tested = [one.name for one in self._unknowns if one.kind == "auto"]
        variances = [one.noise[0] if one.noise else 0.0 for one in found]
        coherences = _core.noise_coherence(self._data.angles, self._data.torques, variances)
        each = [
            Explained(
                one, self._names, settings["chosen"], tested, self._data.period, self._data.step, coherence, self._units
            ).words(method_chosen=self._request.chosen)
            for one, coherence in zip(found, coherences, strict=True)
        ]
        if not self._data.batch:
            return each[0]
        return of_batch(each)

    def _with_plausibility(self, words: Words | Callable[[], Words], batch: Estimates) -> Words:
        """Return words, and before them what a wrong unit, a wrong sign or swapped channels make implausible."""
        told = words if isinstance(words, Words) else words()
        return Plausible(self._data.axis, self._data.period, self._names).before(told, self._data.angles, batch)

    def _words_of_strong_form(
        self, found: Sequence[_core.Identification], batch: Estimates, settings: dict[str, Any]
    ) -> Callable[[], Words]:
        mask, step = self._data.mask, self._data.step
        explained = ExplainedStrong(
            found=batch,
            kinds={name: settings["kinds"][name] for name in self._names},
            untested=[name for place, name in enumerate(self._names) if found[0].unknowns[place].untested],
            settings=settings,
            mask=None if mask is None else mask[..., ::step],
        )
        return explained.words
