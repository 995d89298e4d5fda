"""One call: what is to be identified from what, and how."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._advice import Explained, ExplainedStrong, Words
from tvident._derivatives import plan
from tvident._equation import COEFFICIENTS, Kind, Unknown, all_terms
from tvident._identify.collected import Collected
from tvident._identify.missing import propagate
from tvident._results import Identification

_SHORTEST_WINDOW = 5

_SHORTEST_TEST_FUNCTION = 9

_WINDOW_OF_TERMS = 51
"""Samples of the polynomials that terms of one's own get angle and velocity from in weak form."""


@dataclass
class Task:
    """One call: what is to be identified from what, and how."""

    angles: npt.NDArray[np.number]
    torques: npt.NDArray[np.number]
    time: npt.NDArray[np.float64]
    period: float
    settings: dict[str, Any]
    rounded: float | None
    holes: npt.NDArray[np.bool_] | None
    propagate: bool
    mask: npt.NDArray[np.bool_] | None
    step: int
    workers: int | None
    parameters: dict[str, Kind | float | npt.NDArray[np.number]]

    def __post_init__(self) -> None:
        kinds: dict[str, Kind] = {name: value for name, value in self.parameters.items() if isinstance(value, str)}
        default: Kind = "windowed" if all(kind == "windowed" for kind in kinds.values()) else "constant"
        self.extra = all_terms(self.settings["terms"], default)
        self.unknowns = [Unknown(name, kind) for name, kind in kinds.items()] + self.extra
        if not self.unknowns:
            raise ValueError(
                "at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one"
            )

    def strong(self, progress: arguments.Progress) -> Identification:
        """Identify in strong form."""
        samples, used = self.time.size, self.settings
        length = arguments.window_length("window_length", used["window_length"], self.period, odd=True)
        arguments.check_window("window_length", length, samples, least=_SHORTEST_WINDOW)
        rows = arguments.window_length("equations", used["equations"], self.period, odd=False)
        core_plan = self._plan(length)
        untested = [one.name for one in self.unknowns if one.kind == "auto" and _in_strong_form(one) == "constant"]
        self.unknowns = [Unknown(one.name, _in_strong_form(one), one.own) for one in self.unknowns]
        kinds = {unknown.kind for unknown in self.unknowns}
        found = Collected(self.angles.shape[:-1], [unknown.name for unknown in self.unknowns])
        options: dict[str, Any] = {"step": self.step, "workers": self.workers}
        if "windowed" in kinds:
            arguments.check_window("equations", rows, samples, least=len(self.unknowns) + 1)
        motions = self._motions(core_plan)
        plain = not used["filter_torque"] and used["lag"] == 0 and self.mask is None
        whole = self.holes is None or self.propagate
        with arguments.reporter(progress, "identification") as report:
            options["progress"] = report
            if plain and whole and kinds == {"windowed"} and used["variation"] == "constant":
                found.windowed(core_plan, motions, rows, **options)
            elif plain and kinds == {"constant"}:
                found.constant(core_plan, motions, **options)
            else:
                options |= {"filter_torque": used["filter_torque"], "lag": used["lag"] / self.period}
                options |= {"linear": used["variation"] == "linear", "equations": rows}
                words = [unknown.kind for unknown in self.unknowns]
                each = [
                    _core.identify_strong(core_plan, motions, record, words, mask=self._mask(record), **options)
                    for record in range(self._records)
                ]
                found.records(each, self._numbers)
                if self.propagate and self.holes is not None:
                    propagate(found, self.holes, [(length, rows)] * self._records, self.step)
        chosen = {"chosen": (), "window_length": length, "exponent": None, "equations": rows}
        explained = ExplainedStrong(
            values=found.values,
            errors=found.errors,
            covariances=found.covariances,
            factors=found.factors,
            kinds={unknown.name: unknown.kind for unknown in self.unknowns},
            untested=untested,
            condition=found.condition,
            order=found.order,
            status=found.status,
            settings=used | {"window_length": length},
            mask=None if self.mask is None else self.mask[..., :: self.step],
        )
        return self._result(found, chosen, explained.words())

    def weak(self, progress: arguments.Progress) -> Identification:
        """Identify in weak form."""
        samples, used = self.time.size, self.settings
        lengths = [self._length(value) for value in self._each("window_length")]
        equations = [self._equations(value) for value in self._each("equations")]
        exponents = [
            None if value == "auto" else arguments.whole_number("exponent", value) for value in self._each("exponent")
        ]
        average = used["selection"] != "window"
        kinds = self._weak_kinds(average=average)
        own = any(unknown.own is not None for unknown in self.extra)
        core_plan = self._plan(min(_WINDOW_OF_TERMS, (samples - 1) // 2 * 2 + 1)) if own else None
        motions = self._motions(core_plan)
        lags = [None if lag == "auto" else lag / self.period for lag in self._each("lag")]
        present = [unknown.name for unknown in self.extra] + ([] if used["lag"] == 0 else ["lag"])
        if not isinstance(self.parameters["stiffness"], str):
            # A cubic spring beside a known one is not a question that anybody asked.
            present.append("cubic")
        found = Collected(self.angles.shape[:-1], [unknown.name for unknown in self.unknowns])
        with arguments.reporter(progress, "identification") as report:
            each = [
                _core.identify_weak(
                    motions,
                    record,
                    kinds,
                    delta=self.period,
                    half_width=None if length is None else length // 2,
                    exponent=exponent,
                    equations=rows,
                    average=average,
                    linear=used["variation"] == "linear",
                    lag=lag,
                    quantisation=self.rounded,
                    mask=self._mask(record),
                    step=self.step,
                    not_missing=present,
                    workers=self.workers,
                    progress=report,
                )
                for record, (length, exponent, rows, lag) in enumerate(
                    zip(lengths, exponents, equations, lags, strict=True)
                )
            ]
        found.records(each, self._numbers)
        if self.propagate and self.holes is not None:
            reached = [(2 * one["half_width"] + 1, one["equations"]) for one in each]
            propagate(found, self.holes, reached, self.step)
        names = dict(zip(self._numbers, (unknown.name for unknown in self.unknowns), strict=True))
        tested = [one.name for one in self.unknowns if one.kind == "auto"]
        asked = {"window_length": lengths, "exponent": exponents, "equations": equations}
        automatic = tuple(name for name, values in asked.items() if None in values)
        automatic += ("lag",) if used["lag"] == "auto" else ()
        explained = [Explained(one, names, automatic, tested, self.period) for one in each]
        words = [one.words(form_chosen=used["form_chosen"]) for one in explained]
        chosen: dict[str, Any] = {
            "chosen": automatic,
            "window_length": tuple(2 * one["half_width"] + 1 for one in each),
            "exponent": tuple(one["exponent"] for one in each),
            "equations": tuple(one["equations"] for one in each),
        }
        if used["lag"] == "auto":
            known = [one["lag"] or (0.0, np.nan) for one in each]
            late, error = (tuple(lag[place] * self.period for lag in known) for place in (0, 1))
            chosen |= {"lag": late, "lag_stderr": error}
        if len(each) == 1:
            chosen |= {name: value[0] for name, value in chosen.items() if name != "chosen"}
            slow = {names[number] for number in each[0]["changing"]} & set(COEFFICIENTS)
            self.unknowns = [Unknown(one.name, _in_the_end(one, slow), one.own) for one in self.unknowns]
        else:
            # What is constant in some records and changes in others stays to be tested in each.
            self.unknowns = [
                Unknown(one.name, "constant" if one.name in found.constants else one.kind, one.own)
                for one in self.unknowns
            ]
        return self._result(found, chosen, words[0] if len(words) == 1 else _of_batch(words))

    def _each(self, name: str) -> Sequence[Any]:
        """Return a setting of every record: the same for all, or what an earlier call chose for each."""
        value = self.settings[name]
        if not isinstance(value, tuple | list):
            return [value] * self._records
        if len(value) != self._records:
            raise ValueError(
                f"{name} must be one number, or one for each of the {self._records} records; got {len(value)}; "
                "give settings of a result with as many records"
            )
        return value

    def _length(self, value: int | str) -> int | None:
        """Return the samples of a test function, None for those that are to be chosen."""
        if value == "auto":
            return None
        length = arguments.window_length("window_length", value, self.period, odd=True)
        arguments.check_window("window_length", length, self.time.size, least=_SHORTEST_TEST_FUNCTION)
        return length

    def _equations(self, value: int | str) -> int | None:
        """Return the samples of a window of equations, None for those that are to be chosen."""
        if value == "auto":
            return None
        rows = arguments.window_length("equations", value, self.period, odd=False)
        arguments.check_window("equations", rows, self.time.size, least=len(self.unknowns) + 1)
        return rows

    @property
    def _records(self) -> int:
        return int(np.prod(self.angles.shape[:-1], dtype=int))

    @property
    def _numbers(self) -> list[int]:
        """What the core calls the unknowns: coefficients by their place, then the terms."""
        unknown = [place for place, name in enumerate(COEFFICIENTS) if isinstance(self.parameters[name], str)]
        return unknown + [len(COEFFICIENTS) + place for place in range(len(self.extra))]

    def _weak_kinds(self, *, average: bool) -> list[str]:
        """Return the kinds by the words of the core."""
        words: list[str] = []
        several = any(one.kind == "windowed" for one in self.unknowns if one.name not in {"inertia", "damping"})
        for one in self.unknowns:
            kind: str = one.kind
            if kind == "auto":
                kind = "windowed" if one.name == "stiffness" else "auto"
            if average and several and kind == "windowed" and one.name in {"inertia", "damping"}:
                # In windows short enough for the stiffness they cannot be told from it.
                kind = "varying"
            if kind == "varying" and (not average or not several):
                kind = "windowed"
            words.append(kind)
        return words

    def _plan(self, length: int) -> _core.LocalPolynomials:
        return plan(
            length,
            order=None,
            max_order=arguments.whole_number("max_order", self.settings["max_order"], least=0),
            criterion=self.settings["criterion"],
            selection=self.settings["selection"] if self.settings["form"] == "strong" else "window",
            derivatives=(0, 1, 2),
            delta=self.period,
            noise=True,
            quantisation=self.settings["quantisation"],
        )

    def _motions(self, core_plan: _core.LocalPolynomials | None) -> _core.Motions:
        columns: list[npt.NDArray[np.number] | str] = [unknown.name for unknown in self.extra]
        if core_plan is not None and any(unknown.own is not None for unknown in self.extra):
            (angle, velocity, _), *_ = core_plan.estimate(self.angles, workers=self.workers)
            columns = [
                unknown.own.values(self.time, angle, velocity) if unknown.own else unknown.name
                for unknown in self.extra
            ]
        known = [None if isinstance(value, str) else value for value in self.parameters.values()]
        return _core.Motions(self.angles, self.torques, known, columns)

    def _mask(self, record: int) -> npt.NDArray[np.bool_] | None:
        if self.mask is None:
            return None
        return np.ascontiguousarray(self.mask.reshape(-1, self.time.size)[record])

    def _result(self, found: Collected, chosen: Mapping[str, Any], words: Words) -> Identification:
        known = {name: value for name, value in self.parameters.items() if not isinstance(value, str)}
        found.add_known(known, self.step)
        kinds: dict[str, str] = dict.fromkeys(COEFFICIENTS, "known")
        kinds |= {unknown.name: unknown.kind for unknown in self.unknowns}
        used = self.settings
        same = (
            "preset",
            "form",
            "max_order",
            "criterion",
            "selection",
            "variation",
            "filter_torque",
            "lag",
            "quantisation",
        )
        terms = tuple((one.own or one.name, one.kind) for one in self.unknowns if one.name not in COEFFICIENTS)
        jumps: tuple[Any, ...] = tuple(tuple(self.time[samples].tolist()) for samples in found.jumps)
        return Identification(
            time=self.time[:: self.step],
            values=found.values,
            errors=found.errors,
            covariances=found.covariances,
            factors=found.factors,
            constants=found.constants,
            terms=[unknown.name for unknown in self.extra],
            condition=found.condition,
            residual_std=found.residual_std,
            order=found.order,
            status=found.status,
            jumps=jumps if found.status.ndim > 1 else jumps[0],
            settings={
                **{name: used[name] for name in same},
                "sample_rate": 1 / self.period,
                "order": None,
                **chosen,
                "kinds": kinds,
                "terms": terms,
                "known": {name: value if isinstance(value, float) else None for name, value in known.items()},
                "step": self.step,
                "reasons": words.reasons,
                "advice": words.advice,
            },
        )


def _of_batch(each: Sequence[Words]) -> Words:
    """Return the advice of every record; reasons differ too much from one to the next."""
    return Words((), tuple(f"record {record}: {line}" for record, words in enumerate(each) for line in words.advice))


def _in_strong_form(unknown: Unknown) -> Kind:
    """Return the kind of an unknown where nothing tests it."""
    if unknown.kind in {"windowed", "constant"}:
        return unknown.kind
    return "windowed" if unknown.name == "stiffness" or unknown.kind == "varying" else "constant"


def _in_the_end(unknown: Unknown, changing: set[str]) -> Kind:
    """Return the kind that an unknown turned out to be of."""
    if unknown.kind == "auto" and unknown.name != "stiffness":
        return "varying" if unknown.name in changing else "constant"
    return "windowed" if unknown.kind == "auto" else unknown.kind
