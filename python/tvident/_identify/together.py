"""Calls of ``identify`` with repeated trials or several masses: arguments are checked, and rows merged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import grid_of
from tvident._derivatives import plan
from tvident._equation import LINEAR_UNITS, OFFSET, UNITS, Unknown, all_terms
from tvident._identify.columns import WINDOW_OF_TERMS, Columns
from tvident._identify.earlier import check_no_own_terms
from tvident._identify.expanded_terms import expansions_of_terms, in_windows
from tvident._identify.marked import asked_of_trials, without_masked
from tvident._identify.methods import SHORTEST_TEST_FUNCTION, WeakForm, exponent_of
from tvident._units import (
    ROTARY,
    Axis,
    UnitError,
    axis_of,
    factor_to,
    has_unit_in_attributes,
    is_convertible,
    scaled,
    times_in_seconds,
    unit_named,
    unit_said,
)

if TYPE_CHECKING:
    from tvident._expansion import Expansion
    from tvident._merged import Earlier, Masses, MergedIdentification, Sampling, Trials

Numbers = npt.NDArray[np.number]

_ALONE: dict[str, tuple[Any, ...]] = {
    "velocity": (None,),
    "acceleration": (None,),
    "instrument": (None,),
    "lag": (None, 0, 0.0),
    "quantisation": (None,),
    "period": (None,),
    "loss": (None, "squares"),
    "share": (None, ()),
    "align": (None,),
    "nan_policy": ("omit", "raise"),
}
"""Options that merged rows do not know yet, and what they may be."""

_CURES = {
    "velocity": "leave it out: the angle alone tells the motion",
    "acceleration": "leave it out: the angle alone tells the motion",
    "instrument": "identify one trial of one mass with it",
    "lag": "shift the torque by it before, with np.interp, or find it in one trial of one mass",
    "quantisation": "leave it out: the noise of the channels is estimated, that of rounding with it",
    "period": "unwrap the angle before, with np.unwrap(angle, period=…)",
    "loss": "leave out by mask= what holds spikes",
    "share": "leave it out: what is merged shares all of its parameters",
    "align": "shift the torque by it before, with np.interp",
    "nan_policy": "use 'omit', and look at the flag GAP",
}
"""What to do without them."""


@dataclass(frozen=True)
class Options:
    """What ``identify`` was called with.

    Parameters
    ----------
    ensemble_axis, dof_axis : int, optional
    structure : Chain, optional
    phase : array_like or sequence of array_like, optional
    time : mapping
        ``sample_rate``, ``delta`` and ``t``.
    units : mapping
        ``angle_unit``, ``torque_unit`` and ``time_unit``.
    parameters : mapping
        Inertia, damping and stiffness.
    alone : mapping
        Options that merged rows do not know.
    """

    ensemble_axis: int | None
    dof_axis: int | None
    structure: Any
    phase: Any
    method: Any
    time: Mapping[str, Any]
    units: Mapping[str, str | None]
    parameters: Mapping[str, Any]
    terms: Any
    mask: Any
    settings: Any
    weights: Any
    alone: Mapping[str, Any]
    step: int
    workers: int | None
    progress: arguments.Progress

    @classmethod
    def of(cls, call: Mapping[str, Any]) -> Options:
        """Return what a call of ``identify`` asks for."""
        same = (
            "ensemble_axis",
            "dof_axis",
            "structure",
            "phase",
            "method",
            "terms",
            "mask",
            "settings",
            "weights",
            "step",
            "workers",
            "progress",
        )
        return cls(
            **{name: call[name] for name in same},
            time={name: call[name] for name in ("sample_rate", "delta", "t")},
            units={name: call[name] for name in ("angle_unit", "torque_unit", "time_unit")},
            parameters={name: call[name] for name in ("inertia", "damping", "stiffness")},
            alone={name: call[name] for name in _ALONE},
        )

    @property
    def is_asked(self) -> bool:
        """Whether rows are to be merged at all."""
        return any(one is not None for one in (self.ensemble_axis, self.dof_axis, self.structure, self.phase))


def identify_together(angle: Any, torque: Any, options: Options) -> MergedIdentification:
    """Identify what trials or masses share.

    Raises
    ------
    ValueError
        If options do not go together, or shapes differ.
    TypeError
        If there is no sample period, or arrays hold no numbers.
    """
    # Rooms of many files, which calls with one trial of one mass need not wait for.
    from tvident._identify.between_masses import with_lacking  # noqa: PLC0415
    from tvident._identify.look_at_masses import SOUGHT  # noqa: PLC0415
    from tvident._merged import (  # noqa: PLC0415
        AskedTogether,
        Earlier,
        identify_masses,
        identify_trials,
        masses_over_gaps,
        trials_over_gaps,
    )

    _check(angle, options)
    for name, one in (("ensemble_axis", options.ensemble_axis), ("dof_axis", options.dof_axis)):
        if one is not None:
            arguments.whole_number(name, one)
    axis = _axis(angle, torque, options.units)
    form = _weak(options.method)
    earlier = None if options.settings is None else Earlier.of(options.settings)
    terms, kinds = _terms(options.terms, earlier)
    for term in terms:
        if term.inner:
            raise ValueError(
                f"terms with inner parameters are not supported beside ensemble_axis= and dof_axis= yet; got {term.name!r}; "
                "find them in one trial, and give a Term with what was found"
            )
    # One of them is None.
    trials, masses = (_trials if options.dof_axis is None else _masses)(angle, torque, options, axis)
    trials, masses, said = without_masked(trials, masses, axis)
    sampling = _sampling(options, axis, *_channels(trials, masses))
    asked_of = asked_of_trials(*_channels(trials, masses), axis, sampling.period, has_masses=trials is None)
    sampling = replace(sampling, questions=asked_of, said=said)
    with arguments.reporter(options.progress, "identification") as report:
        asked = AskedTogether(
            sampling=sampling,
            parameters={name: value for name, value in options.parameters.items() if value is not None},
            terms=kinds,
            own={one.name: one.own for one in terms if one.own is not None},
            forms=(
                earlier.forms
                if earlier is not None and arguments.is_word(options.method, "auto")
                else [_lengths(form, sampling.period, max(map(len, _channels(trials, masses)[0])))]
            ),
            earlier=earlier,
            units=UNITS if axis.system is ROTARY else LINEAR_UNITS,
            step=arguments.whole_number("step", options.step, least=1),
            workers=arguments.worker_count(options.workers),
            report=report,
        )
        joints = dict.fromkeys([*SOUGHT, *(name for name, _ in getattr(options.structure, "terms", ()))])
        values = _Terms([*all_terms(list(joints), "constant"), *terms], sampling.period, asked.workers)
        if sampling.clock is not None:
            if trials is not None:
                return identify_trials(trials.on_grid(sampling), asked, values)
            masses = [one.on_grid(sampling) for one in masses]
            return with_lacking(identify_masses(masses, asked, values), masses, asked, values)
        if trials is not None:
            whole, bridges = trials_over_gaps(trials, options.settings, asked.workers)
            return identify_trials(whole, asked.bridged(bridges), values)
        joint, bridges = masses_over_gaps(masses, options.settings, asked.workers)
        asked = asked.bridged(bridges)
        return with_lacking(identify_masses(joint, asked, values), joint, asked, values)


def _trials(angle: Any, torque: Any, options: Options, axis: Axis) -> tuple[Trials, list[Masses]]:
    """Return repeated trials of one mass, with their weights, and no masses."""
    from tvident._merged import trials_of, weights_of_trials  # noqa: PLC0415 - likewise

    trials = trials_of(angle, torque, options.ensemble_axis or 0, phase=options.phase, mask=options.mask)
    trials = trials.scaled(axis.angle, axis.torque)
    weights = weights_of_trials(options.weights, [one.size for one in trials.angles], several=True)
    for place in range(len(trials.angles)):
        own = None if weights is None else weights[place]
        _check_nan({"angle": [trials.angles[place]], "torque": [trials.torques[place]]}, own, options)
    return trials.weighted(weights), []


def _masses(angle: Any, torque: Any, options: Options, axis: Axis) -> tuple[None, list[Masses]]:
    """Return no trials of one mass, but the masses of every trial, with their weights."""
    from tvident._merged import masses_of, of_core, weights_of_trials  # noqa: PLC0415 - likewise

    structure = _in_unit_of_angle(options.structure, axis)
    found = masses_of(angle, torque, options.dof_axis or 0, structure, trials=options.ensemble_axis, mask=options.mask)
    masses = [one.scaled(axis.angle, axis.torque) for one in found]
    lengths = [one.angles[0].size for one in masses]
    weights = weights_of_trials(options.weights, lengths, several=options.ensemble_axis is not None)
    for place, one in enumerate(masses):
        _check_nan({"angle": one.angles}, None if weights is None else weights[place], options)
    if weights is None:
        return None, masses
    of_rows = of_core(weights) or [None] * len(weights)
    return None, [one.weighted(own, rows) for one, own, rows in zip(masses, weights, of_rows, strict=True)]


def _in_unit_of_angle(structure: Any, axis: Axis) -> Any:
    """Return a chain whose base says a unit of its own with a base in that of the angle, in which it is taken."""
    base = getattr(structure, "base", None)
    if base is None:
        return structure
    said = unit_said(base)
    named = "" if said else unit_named(base)
    # A name that a product kept says nothing.
    unit = named if is_convertible(axis.system, "angle", named) else said
    if not unit:
        return structure
    factor = factor_to(axis.system, "angle", unit, name="the base") / axis.angle
    if factor == 1:
        return structure
    if not said or has_unit_in_attributes(base):
        by, keeps = (
            ("an attribute", "arithmetic keeps attributes")
            if said
            else ("its name", "what is computed from a series keeps the name")
        )
        raise UnitError(
            f"the base must be in the unit of the angle where only {by} says {unit!r}: {keeps}, so nobody "
            f"knows whether the numbers still are; pass tvident.Channel(base, {unit!r}), or .to_numpy() if they were converted"
        )
    numbers = arguments.plain("base", base)
    is_list = isinstance(base, list | tuple)
    each = [scaled(np.asarray(one), factor) for one in (numbers if is_list else [numbers])]
    return replace(structure, base=each if is_list else each[0])


def _check_nan(channels: Mapping[str, Sequence[Numbers]], weights: Numbers | None, options: Options) -> None:
    """Refuse what is not finite where that was asked for, but where no weight is."""
    for name, each in channels.items():
        for one in each:
            counted = one if weights is None else np.where(weights > 0, one, 0)
            arguments.check_nan(name, counted, options.alone["nan_policy"], arguments.RowPolicy)


def _channels(trials: Trials | None, masses: Sequence[Masses]) -> tuple[Sequence[Numbers], Sequence[Numbers]]:
    """Return all angles and all torques."""
    if trials is not None:
        return trials.angles, trials.torques
    torques = [one for of in masses for one in of.torques if one is not None]
    return [one for of in masses for one in of.angles], torques


def _terms(given: Any, earlier: Earlier | None) -> tuple[list[Unknown], list[tuple[str, str | Expansion | None]]]:
    """Return terms, and their names and kinds; no kind where an earlier result tells it."""
    if given is None and earlier is not None:
        check_no_own_terms(earlier.own_terms, earlier.terms)
        given = earlier.terms
    pairs = ((OFFSET, "constant"),) if given is None else given
    functions = expansions_of_terms(pairs)
    terms = all_terms(in_windows(pairs), "constant")
    if earlier is None:
        return terms, [(one.name, functions.get(one.name, one.kind)) for one in terms]
    said = [isinstance(one, tuple | list) for one in given]
    kinds = [functions.get(one.name, one.kind) if told else None for one, told in zip(terms, said, strict=True)]
    return terms, [(one.name, kind) for one, kind in zip(terms, kinds, strict=True)]


def _sampling(options: Options, axis: Axis, angles: Sequence[Numbers], torques: Sequence[Numbers]) -> Sampling:
    """Return when samples were taken."""
    from tvident._merged import Sampling  # noqa: PLC0415 - likewise

    samples, workers = max(map(len, angles)), arguments.worker_count(options.workers)
    try:
        period, times = sampled(options.time, samples, axis, options.units["time_unit"])
        longest = next(one for one in angles if len(one) == samples)
        arguments.check_no_lost_samples(times, longest)
    except arguments.NotUniformError as error:
        lengths = {one.size for one in (*angles, *torques)}
        if len(lengths) > 1:
            raise ValueError(
                f"t must be uniform beside trials of different lengths; got {min(lengths)} to {max(lengths)} samples and steps that "
                "scatter; resample each trial"
            ) from None
        return Sampling.of_grid(grid_of(error.times), angles, torques, workers)
    return Sampling(period, arguments.begin_of(times))


class _Terms:
    """Terms by their names, of any angle."""

    def __init__(self, terms: Sequence[Unknown], period: float, workers: int | None) -> None:
        self._terms = {one.name: one for one in terms}
        self._period = period
        self._workers = workers

    def __call__(self, name: str, angle: Numbers) -> npt.NDArray[np.float64]:
        time = np.arange(angle.size, dtype=np.float64) * self._period
        columns = Columns(
            [self._terms[name]],
            angle,
            time,
            self._period,
            lambda: self._plan(angle.size),
            weak=True,
            workers=self._workers,
        )
        return np.asarray(columns.all_samples({})[name], np.float64)

    def motion(self, angles: Numbers) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return smoothed angles and velocities, of the angles' shape."""
        angle, velocity, _ = self._plan(angles.shape[-1]).estimate(angles, workers=self._workers).derivatives
        return angle, velocity

    def _plan(self, samples: int) -> Any:
        length = min(WINDOW_OF_TERMS, (samples - 1) // 2 * 2 + 1)
        return plan(length, order=None, derivatives=(0, 1, 2), delta=self._period, noise=True)


def _check(angle: Any, options: Options) -> None:
    """Refuse what does not go together."""
    if angle is None:
        raise ValueError(
            "ensemble_axis= and dof_axis= need the angle; got angle=None, which is not supported there yet; integrate the velocity"
        )
    for name, allowed in _ALONE.items():
        value = options.alone[name]
        if not any(value is one or (isinstance(value, int | float | str | tuple) and value == one) for one in allowed):
            raise ValueError(
                f"{name}= is not supported beside ensemble_axis= and dof_axis= yet; got {arguments.shown(value)}; {_CURES[name]}"
            )
    if options.structure is not None and options.dof_axis is None:
        raise ValueError(
            f"structure= must come with dof_axis=, the axis of the masses; got {arguments.shown(options.structure)} alone; add dof_axis=0"
        )
    if (
        options.ensemble_axis is None
        and isinstance(angle, list | tuple)
        and any(getattr(one, "ndim", 0) > 1 for one in angle)
    ):
        raise ValueError(
            f"a list beside dof_axis= must be of trials; got {len(angle)} of several masses without ensemble_axis=; give ensemble_axis=0 "
            "and dof_axis=1, or identify one after the other"
        )
    if options.phase is not None and options.dof_axis is not None:
        raise ValueError(
            "phase= aligns trials of one mass; got dof_axis=, beside which it is not supported yet; cut trials to the same length, and "
            "leave phase= out"
        )


def _weak(method: Any) -> WeakForm:
    """Return the settings of the weak form, which is the only one that merges rows."""
    form = WeakForm() if arguments.is_word(method, "auto") else method
    if not isinstance(form, WeakForm):
        raise ValueError(  # noqa: TRY004 - the strong form is of the right type elsewhere
            f"method must be 'auto' or a WeakForm beside ensemble_axis= and dof_axis=; got {arguments.shown(method)}, which "
            "is not supported there yet; leave it out"
        )
    if form.variation == "constant":
        raise ValueError(
            "variation must be 'auto' or 'linear' beside ensemble_axis= and dof_axis=; got 'constant', which is not supported there yet; "
            "leave it out"
        )
    return form


def _axis(angle: Any, torque: Any, units: Mapping[str, str | None]) -> Axis:
    """Return how channels are converted; those of a list have one unit."""
    return axis_of(angle, torque, None, **units)


def sampled(
    given: Mapping[str, Any], samples: int, axis: Axis, time_unit: str | None, channel: Any = None
) -> tuple[float, Any]:
    """Return the sample period in seconds from ``sample_rate``, ``delta`` or ``t``, or from the index of a channel, and times in seconds.

    Raises
    ------
    TypeError
        If none of them is given, or several.
    """
    time = dict(given)
    if all(value is None for value in time.values()):
        implied = None if channel is None else arguments.implied_times(channel)
        if implied is None:
            cure = "" if channel is None else arguments.cure_by_labels(channel)
            raise TypeError(f"identify needs the sample period; got none; give sample_rate=, delta= or t={cure}")
        implied = times_in_seconds(implied, time_unit, has_argument=True)
        return arguments.sample_period(samples, t=implied), implied
    if time_unit is not None and time["sample_rate"] is not None:
        raise TypeError(
            f"time_unit= is the unit of t= and delta=; got {arguments.shown(time_unit)} beside sample_rate=, which is in Hz; leave it "
            "out, or give delta= in its place"
        )
    if time["t"] is not None:
        time["t"] = times_in_seconds(time["t"], time_unit, has_argument=True)
    time["delta"] = arguments.in_unit_of_time(time["delta"], axis.time)
    period = arguments.sample_period(samples, **time)
    if time_unit is None or time["t"] is None:
        arguments.check_against_labels(channel, period)
    return period, time["t"]


def _lengths(form: WeakForm, period: float, samples: int) -> dict[str, int | None]:
    """Return the settings of the form in samples, None where they are chosen."""
    length, rows = form.window_length, form.regression_window
    found: dict[str, int | None] = {"window_length": None, "regression_window": None, "exponent": None}
    if not arguments.is_word(length, "auto"):
        checked = arguments.window_length("window_length", length, period, odd=True)
        arguments.check_window("window_length", checked, samples, least=SHORTEST_TEST_FUNCTION)
        found["window_length"] = checked
    if not arguments.is_word(rows, "auto"):
        found["regression_window"] = arguments.window_length("regression_window", rows, period, odd=False)
    if not arguments.is_word(form.exponent, "auto"):
        found["exponent"] = int(exponent_of(form.exponent))
    return found
