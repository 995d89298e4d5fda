"""Identification with expanded parameters: windows tell noise, lag and test function, then sums of functions take their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._advice import found_expansion, untold, words_of_expansions
from tvident._equation import has_kind
from tvident._expansion import Expansion, SizeSearch, check_expansion, of_one, refuse, refuse_windows
from tvident._identify.data import Data
from tvident._identify.expanded_inputs import ExpandedInputs, role_of
from tvident._identify.expanded_result import ExpandedOutcome
from tvident._identify.expanded_terms import expansions_of_terms, in_windows
from tvident._identify.methods import WeakForm
from tvident._identify.settings import Request, plain
from tvident._identify.task import Task
from tvident._results import ExpandedFit, ExpandedParameter, Identification, Recorded
from tvident._status import Status, untold_samples


def expansions_of(request: Request) -> dict[str, Expansion]:
    """Return the expansions that are asked for, by the names of parameters and terms."""
    found = {name: one for name, one in request.parameters.items() if isinstance(one, Expansion)}
    return found | expansions_of_terms(request.terms)


class ExpandedTask:
    """One call in which parameters are expansions.

    Parameters
    ----------
    data : Data
    request : Request
    """

    def __init__(self, data: Data, request: Request) -> None:
        self._data, self._request = data, request
        self._expansions = expansions_of(request)
        self._check()

    def run(self, progress: arguments.Progress) -> Identification:
        """Identify windows, then the factors of the expansions."""
        whole = replace(self._data, step=1, labels=None)
        task = Task(whole, self._pilot_request())
        # Errors of inner parameters come with what may be missing.
        pilot = task.run(progress, diagnose=bool(task.inner))
        chosen = all(isinstance(pilot.settings[name], int) for name in ("window_length", "exponent"))
        if not chosen or _determines_nothing(pilot):
            return pilot  # its status says so
        given = ExpandedInputs(self._data, self._request, self._expansions, task, pilot)
        search = SizeSearch([given.record], given.parts, given.noise, given.known)
        found = search.run(given.start)
        fit = ExpandedFit(search, self._expansions, self._data.units, *found)
        return self._result(ExpandedOutcome(given, fit.with_errors_of_residuals()))

    def _result(self, outcome: ExpandedOutcome) -> Identification:
        data, pilot, fit = self._data, outcome.given.pilot, outcome.fit
        curves = fit.curves
        found = outcome.estimates()
        told = []
        for name, one in curves.items():
            windows = outcome.windows(name)
            told.append(
                found_expansion(
                    one, self._expansions[name], windows, (found.values[name], found.errors[name]), data.time
                )
            )
        doubts = outcome.doubts_of_windows
        if any(one.is_contradicted for one in told):
            doubts |= Status.KIND_CONTRADICTED
        found = replace(found, record_status=Status(int(np.asarray(found.record_status))) | doubts)
        kinds = {name: str(kind) for name, kind in pilot.settings["kinds"].items() if name not in curves}
        changing = [
            name
            for name, kind in kinds.items()
            if arguments.is_word(self._request.parameters.get(name), "auto") and kind not in {"constant", "known"}
        ]
        words = words_of_expansions(
            told,
            fit.independent,
            fit.ratio,
            changing,
            doubted=bool(outcome.doubts_of_windows),
            determined=bool(np.isfinite(fit.fitted.condition)),
        )
        dark = untold(untold_samples(found.status), list(curves), data.period * data.step)
        if data.labels is not None:
            found = replace(found, labels=data.labels.at(slice(None, None, data.step)))
        return Identification(
            found,
            time=data.time[:: data.step],
            terms=list(pilot.terms),
            jumps=(),
            words=replace(words, advice=(*(line for _, line in data.doubts), *words.advice, *dark)),
            settings=plain(outcome.settings(self._request.name)),
            recorded=self._recorded(pilot._recorded, curves),  # noqa: SLF001 - parts of this package
        )

    def _recorded(self, recorded: Recorded | None, curves: Mapping[str, ExpandedParameter]) -> Recorded | None:
        """Return the record, which can be identified once more with functions as many as were found."""
        if recorded is None:
            return None
        fixed = {name: replace(one, size=curves[name].size) for name, one in self._expansions.items()}

        def again(angles: npt.NDArray[np.number]) -> Identification:
            request = with_expansions(self._request, fixed)
            data = replace(self._data, angles=angles, propagate=False, step=1, labels=None)
            return ExpandedTask(data, request).run(progress=None)

        return replace(recorded, again=again, improve=None)

    def _pilot_request(self) -> Request:
        """Return the request with windows, or what the record decides, in the place of expansions."""
        given = self._request.parameters
        windows = {
            name: ("windowed" if name == "stiffness" else "auto") if isinstance(one, Expansion) else one
            for name, one in given.items()
        }
        # Without a windowed parameter terms without a kind are constant, as they are beside an expansion.
        terms = [
            term if isinstance(term, tuple | list) else (term, "constant") for term in in_windows(self._request.terms)
        ]
        return replace(self._request, parameters=windows, terms=terms)

    def _check(self) -> None:
        """Refuse what an expansion cannot stand beside."""
        data = self._data
        if data.batch:
            refuse("an Expansion is for one record at a time", f"shape {data.angles.shape}", "identify each in turn")
        if not isinstance(self._request.form, WeakForm):
            refuse("an Expansion needs the weak form", "the strong form", "leave method= out, or give a WeakForm")
        if data.instruments is not None:
            refuse("an Expansion has no instruments", "instrument=", "leave one of them out")
        if data.motion.recorded:
            channels = " and ".join(data.motion.recorded)
            refuse("an Expansion needs the angle alone", channels, "leave the other channels out")
        self._check_others()
        for name, one in self._expansions.items():
            check_expansion(name, of_one(role_of(name, one)), one, data.time.size)

    def _check_others(self) -> None:
        """Refuse windows beside an expansion."""
        refuse_windows(next(iter(self._expansions)), self._request.parameters)
        for term in self._request.terms:
            if isinstance(term, tuple | list) and arguments.is_word(term[1], "windowed"):
                called = getattr(term[0], "name", term[0])
                refuse(
                    "beside an Expansion terms are constant or expansions", f"{called!r} windowed", "make it constant"
                )


def with_expansions(request: Request, expansions: Mapping[str, Expansion]) -> Request:
    """Return a request with other expansions of the same parameters and terms."""
    parameters = {name: expansions.get(name, one) for name, one in request.parameters.items()}
    terms = []
    for term in request.terms:
        pair = has_kind(term)
        name = getattr(term[0], "name", term[0]) if pair else term
        terms.append((term[0], expansions[name]) if pair and name in expansions else term)
    return replace(request, parameters=parameters, terms=terms)


def _determines_nothing(pilot: Identification) -> bool:
    """Return whether a record says nothing of any parameter: windows have no numbers, and that is the whole record's."""
    is_deficient = Status.RANK_DEFICIENT in Status(int(np.asarray(pilot.record_status)))
    return is_deficient and bool(np.all(np.asarray(pilot.status) & int(Status.INVALID)))
