"""The core's entries for identification as one: the same call and the same results, whatever the form."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import COEFFICIENTS
from tvident._identify.missing import propagate_missing
from tvident._status import RECORD_FLAGS, Status

Array = npt.NDArray[Any]


@dataclass
class Found:
    """One unknown of one record."""

    kind: str
    values: Array
    stderr: Array
    factor: float = 1.0
    test: tuple[float, float] | None = None
    untested: bool = False


@dataclass
class Identified:
    """One record."""

    window_length: int
    exponent: int | None
    regression_window: int
    unknowns: list[Found]
    covariances: dict[tuple[int, int], Array]
    condition: Array
    residual_std: Array
    status: Array
    order: Array
    record_status: int = 0
    noise: tuple[float, float] | None = None
    lengths: list[tuple[int, float]] = field(default_factory=list)
    prediction_error: float = 1.0
    weighted: bool = False
    pooling: float | None = None
    weakest: list[float] = field(default_factory=list)
    mostly_noise: bool = False
    constants_condition: float = 1.0
    lag: tuple[float, float] | None = None
    suspects: list[Any] = field(default_factory=list)
    outside_mask: Any = None
    jumps: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class WeakForm:
    window_length: Sequence[int | None]
    exponent: Sequence[int | None]
    regression_window: Sequence[int | None]
    averaging: bool
    linear: bool


@dataclass(frozen=True)
class StrongForm:
    plan: _core.LocalPolynomials
    window_length: int
    regression_window: int
    filter_torque: bool
    linear: bool


@dataclass(frozen=True)
class Call:
    """What is the same for all records."""

    motions: _core.Motions
    names: Sequence[str]
    kinds: Sequence[str]
    lag: Sequence[Any]
    quantisation: float | None
    mask: Array | None
    holes: Array | None
    propagate: bool
    step: int
    delta: float
    not_missing: Sequence[str]
    workers: int | None
    records: int

    @property
    def numbers(self) -> list[int]:
        """What the core calls the unknowns: coefficients by their place, then the terms."""
        unknown = [COEFFICIENTS.index(name) for name in self.names if name in COEFFICIENTS]
        return unknown + [len(COEFFICIENTS) + place for place in range(len(self.names) - len(unknown))]

    def mask_of(self, record: int) -> Array | None:
        if self.mask is None:
            return None
        return np.ascontiguousarray(self.mask.reshape(-1, self.mask.shape[-1])[record])

    @property
    def running(self) -> dict[str, Any]:
        return {"step": self.step, "workers": self.workers}


Progress = Callable[[int, int], object] | None


def identify(call: Call, form: WeakForm | StrongForm, progress: Progress) -> list[Identified]:
    """Identify every record."""
    return _weak(call, form, progress) if isinstance(form, WeakForm) else _strong(call, form, progress)


def _strong(call: Call, form: StrongForm, progress: Progress) -> list[Identified]:
    kinds = [_in_strong_form(name, kind) for name, kind in zip(call.names, call.kinds, strict=True)]
    plain = not form.filter_torque and call.lag[0] == 0 and call.mask is None
    whole = call.holes is None or call.propagate
    if plain and whole and set(kinds) == {"windowed"} and not form.linear:
        found = _windowed(call, form, progress)
    elif plain and set(kinds) == {"constant"}:
        found = _constant(call, form, progress)
    else:
        options: dict[str, Any] = {
            "filter_torque": form.filter_torque,
            "linear": form.linear,
            "equations": form.regression_window,
        }
        found = [
            _one(
                call,
                _core.identify_strong(
                    form.plan,
                    call.motions,
                    record,
                    kinds,
                    mask=call.mask_of(record),
                    lag=call.lag[0],
                    **options,
                    progress=progress,
                    **call.running,
                ),
                kinds,
                (form.window_length, None, form.regression_window),
            )
            for record in range(call.records)
        ]
        if call.propagate and call.holes is not None:
            propagate_missing(found, call.holes, call.step)
    for one in found:
        for unknown, asked in zip(one.unknowns, call.kinds, strict=True):
            unknown.untested = asked == "auto" and unknown.kind == "constant"
    return found


def _windowed(call: Call, form: StrongForm, progress: Progress) -> list[Identified]:
    pairs = list(combinations(range(sum(name in COEFFICIENTS for name in call.names)), 2))
    parameters, errors, covariances, deviation, condition, status, order, factors = _core.identify_windowed(
        form.plan, call.motions, form.regression_window, pairs, progress=progress, **call.running
    )
    return [
        Identified(
            window_length=form.window_length,
            exponent=None,
            regression_window=form.regression_window,
            unknowns=[
                Found("windowed", parameters[record, place], errors[record, place], float(factors[record, place]))
                for place in range(len(call.names))
            ],
            covariances={pair: covariances[record, place] for place, pair in enumerate(pairs)},
            condition=condition[record],
            residual_std=deviation[record],
            status=status[record],
            order=order[record],
        )
        for record in range(call.records)
    ]


def _constant(call: Call, form: StrongForm, progress: Progress) -> list[Identified]:
    values, covariance, deviation, condition, status, order = _core.identify_constant(
        form.plan, call.motions, progress=progress, **call.running
    )
    errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    pairs = list(combinations(range(sum(name in COEFFICIENTS for name in call.names)), 2))
    found = []
    for record in range(call.records):
        undetermined = bool(np.isinf(condition[record]))
        flags = Status.RANK_DEFICIENT if undetermined else Status(0)
        if not undetermined and condition[record] > _core.HARDLY_TOLD_APART:
            flags |= Status.ILL_CONDITIONED
        found.append(
            Identified(
                window_length=form.window_length,
                exponent=None,
                regression_window=form.regression_window,
                unknowns=[
                    Found("constant", values[record, [place]], errors[record, [place]])
                    for place in range(len(call.names))
                ],
                covariances={(one, other): covariance[record, one, [other]] for one, other in pairs},
                condition=condition[[record]],
                residual_std=deviation[[record]],
                status=status[record] | np.uint16(Status.INVALID) if undetermined else status[record],
                order=order[record],
                record_status=int(flags),
            )
        )
    return found


def _weak(call: Call, form: WeakForm, progress: Progress) -> list[Identified]:
    kinds = _weak_kinds(call, averaging=form.averaging)
    found = []
    for record in range(call.records):
        length = form.window_length[record]
        one = _core.identify_weak(
            call.motions,
            record,
            kinds,
            delta=call.delta,
            half_width=None if length is None else length // 2,
            exponent=form.exponent[record],
            equations=form.regression_window[record],
            average=form.averaging,
            linear=form.linear,
            lag=call.lag[record],
            quantisation=call.quantisation,
            mask=call.mask_of(record),
            not_missing=call.not_missing,
            progress=progress,
            **call.running,
        )
        used = (2 * one["half_width"] + 1, one["exponent"], one["equations"])
        found.append(_one(call, one, kinds, used))
    if call.propagate and call.holes is not None:
        propagate_missing(found, call.holes, call.step)
    return found


def _one(call: Call, found: Mapping[str, Any], kinds: Sequence[str], used: tuple[int, int | None, int]) -> Identified:
    """Return what one of the core's dictionaries holds."""
    place = {number: place for place, number in enumerate(call.numbers)}
    constants = {number: (value, error, test) for number, value, error, test in found["constants"]}
    unknowns = []
    for number, kind in zip(call.numbers, kinds, strict=True):
        if number in constants:
            value, error, test = constants[number]
            unknowns.append(Found("constant", np.array([value]), np.array([error]), test=test))
        else:
            row = found["changing"].index(number)
            turned_out = "varying" if kind == "auto" else kind
            unknowns.append(Found(turned_out, found["values"][row], found["errors"][row]))
    pairs = {pair: np.zeros(1) for pair in combinations(range(sum(name in COEFFICIENTS for name in call.names)), 2)}
    for one, other, value in found.get("constant_pairs", ()):
        pairs |= {tuple(sorted((place[one], place[other]))): np.array([value])}  # type: ignore[dict-item]
    for (one, other), values in zip(found["pairs"], found["covariances"], strict=True):
        pairs |= {tuple(sorted((place[one], place[other]))): values}  # type: ignore[dict-item]
    status = found["status"]
    of_the_record = np.uint16(RECORD_FLAGS) & (np.bitwise_and.reduce(status) if status.size else np.uint16(0))
    identified = Identified(
        *used,
        unknowns=unknowns,
        covariances={pair: values for pair, values in pairs.items() if max(pair) < len(call.names)},
        condition=found["conditions"],
        residual_std=found["deviations"],
        status=status & ~of_the_record,
        order=found.get("order", np.zeros(0, np.uint8)),
        record_status=int(of_the_record),
        jumps=found.get("jumps", []),
    )
    if "noise" in found:
        identified.noise, identified.lengths, identified.lag = found["noise"], found["lengths"], found["lag"]
        identified.prediction_error, identified.weighted = found["prediction_error"], found["weighted"]
        identified.pooling, identified.weakest = found["pooling"], found["weakest"]
        identified.mostly_noise, identified.constants_condition = found["mostly_noise"], found["condition"]
        identified.suspects = [Suspect(*one) for one in found["suspects"]]
        if found["outside_mask"] is not None:
            differing, left = found["outside_mask"]
            identified.outside_mask = OutsideMask(
                [(place[number], value, error) for number, value, error in differing], left
            )
    return identified


@dataclass(frozen=True)
class Suspect:
    name: str
    value: float
    stderr: float
    conspicuous: bool


@dataclass(frozen=True)
class OutsideMask:
    differing: list[tuple[int, float, float]]
    residual_ratio: float | None


def _weak_kinds(call: Call, *, averaging: bool) -> list[str]:
    """Return the kinds by the words of the core."""
    words: list[str] = []
    named = list(zip(call.names, call.kinds, strict=True))
    several = any(kind == "windowed" for name, kind in named if name not in {"inertia", "damping"})
    for name, asked in named:
        kind = asked
        if kind == "auto":
            kind = "windowed" if name == "stiffness" else "auto"
        if averaging and several and kind == "windowed" and name in {"inertia", "damping"}:
            # In windows short enough for the stiffness they cannot be told from it.
            kind = "varying"
        if kind == "varying" and (not averaging or not several):
            kind = "windowed"
        words.append(kind)
    return words


def _in_strong_form(name: str, kind: str) -> str:
    """Return the kind of an unknown where nothing tests it."""
    if kind in {"windowed", "constant"}:
        return kind
    return "windowed" if name == "stiffness" or kind == "varying" else "constant"
