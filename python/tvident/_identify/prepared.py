"""What a call of ``identify`` asks of one record or a batch: its arguments, checked and in the units of results, make one task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import Grid, grid_of
from tvident._equation import COEFFICIENTS, LINEAR_UNITS, UNITS, has_kind
from tvident._expansion import Expansion
from tvident._identify.channels import motion_channels
from tvident._identify.data import Data
from tvident._identify.expanded import ExpandedTask, expansions_of
from tvident._identify.marked import without_marks
from tvident._identify.methods import StrongForm, WeakForm
from tvident._identify.own_clocks import OwnClocks, check_every_sample, lag_found, own_clocks
from tvident._identify.read_torque import with_read_torque
from tvident._identify.robust import loss_of, with_clipped_torque
from tvident._identify.settings import Request, is_strong, resolve
from tvident._identify.signals import (
    Signals,
    channels_of_motion,
    even_times,
    instrument_of,
    with_known,
    with_own_step,
)
from tvident._identify.task import Task
from tvident._identify.together import sampled
from tvident._identify.weighted import usable_channels, weights_of
from tvident._results import Identification
from tvident._units import (
    ROTARY,
    Axis,
    UnitError,
    axis_of,
    factor_between,
    factor_of_derivative,
    has_unit_in_attributes,
    scaled,
    unit_said,
)


# One step after the other, each with what all before it found.
def prepared(call: Mapping[str, Any]) -> Task | ExpandedTask:
    """Return the task of a call.

    Parameters
    ----------
    call : mapping of str to object
        Arguments of :func:`identify` by name, and `wanted`, the samples at which numbers are wanted, where these are not all.

    Raises
    ------
    ValueError, TypeError
        As :func:`identify` does.
    """
    motion = {"angle": call["angle"], "velocity": call["velocity"], "acceleration": call["acceleration"]}
    measured = channels_of_motion(motion)
    first = next(iter(measured.values()))
    axis = axis_of(
        call["angle"],
        call["torque"],
        None if isinstance(call["t"], tuple) else call["t"],
        angle_unit=call["angle_unit"],
        torque_unit=call["torque_unit"],
        time_unit=call["time_unit"],
    )
    sampling = {name: call[name] for name in ("sample_rate", "delta", "t")}
    beside_clocks = {name: call[name] for name in ("instrument", "mask", "period")}
    clocks = own_clocks(
        {**motion, "torque": call["torque"], **beside_clocks},
        sampling,
        call["align"],
        time_unit=call["time_unit"],
        propagate=call["nan_policy"] == "propagate",
        by_angle=is_strong(call["method"], call["settings"]) or _has_expansions(call),
    )
    torque, weighted = call["torque"], None
    if clocks is not None:
        clocks, weighted = clocks.weighted(call["weights"], call["settings"], call["nan_policy"])
        measured["angle"], torque = clocks.channels()
        sampling = {"sample_rate": 1 / clocks.clocks.period, "delta": None, "t": None}
    *arrays, torques = arguments.channels(**measured, torque=torque)
    factors = {name: _factor_of(name, call[name], axis) for name in measured} | {"torque": axis.torque}
    channels = {name: scaled(values, factors[name]) for name, values in zip(measured, arrays, strict=True)}
    torques = scaled(torques, axis.torque)
    # Times of two clocks are in seconds by now.
    time_unit = call["time_unit"] if clocks is None or call["sample_rate"] is not None else None
    seconds, grid, begin = _sampling(sampling, axis, time_unit, first, next(iter(channels.values())))
    if clocks is None:
        others = any(one is not None for one in beside_clocks.values())
        check_every_sample({**channels, "torque": torques}, seconds, others=others, in_parts="wanted" in call)
    instruments = instrument_of(call["instrument"], torques.shape)
    request = resolve(
        call["method"],
        _equation(call, axis),
        call["settings"],
        1 / seconds,
        list(measured),
        has_instrument=instruments is not None,
    )
    asked = loss_of(call["loss"], call["settings"])
    weighted = weights_of(call["weights"], torques.shape) if clocks is None else weighted
    # What two clocks recorded was checked before; on the grid their gaps are no samples.
    channels, torques = usable_channels(channels, torques, weighted, call["nan_policy"] if clocks is None else "omit")
    channels, torques, doubts, said = without_marks(
        {**channels, "torque": torques}, factors, call, request.period, seconds
    )
    turn = request.period
    if turn is not None:
        # Whole periods need not be multiples of the step that the angle was rounded to.
        request = with_own_step(request, channels)
        turned = arguments.unwrapped("angle", channels["angle"], turn)
        channels["angle"], doubts[len(doubts) :] = turned.longest("angle", split=request.counts_turns)
    propagate = call["nan_policy"] == "propagate"
    signals = Signals(
        channels,
        torques,
        instruments,
        arguments.mask("mask", call["mask"], torques.shape),
        even_times(torques.shape[-1], seconds, begin),
        seconds,
        weighted,
    )
    if grid is not None:
        signals, request = signals.on_grid(
            grid, request, call["settings"], propagate=propagate, workers=call["workers"]
        )
    request = _on_clocks(request, clocks, call["settings"])
    is_bridged = grid is None and clocks is None and not propagate and isinstance(request.form, WeakForm)
    if is_bridged:
        signals, request = signals.over_holds(request, call["settings"], workers=call["workers"])
        signals, request = signals.over_gaps(request, call["settings"], workers=call["workers"])
    moving = motion_channels(
        signals.channels,
        signals.period,
        has_spring=request.has_spring,
        quantisation=request.quantisation,
        passed=signals.passed.get(next(iter(measured))),
        weights=None if signals.weights is None else signals.weights.values,
    )
    data = Data(
        angles=moving.angles,
        motion=moving,
        torques=signals.torques,
        time=signals.time,
        period=signals.period,
        instruments=signals.instruments,
        mask=signals.mask,
        propagate=propagate,
        step=arguments.whole_number("step", call["step"], least=1),
        workers=arguments.worker_count(call["workers"]),
        doubts=[*doubts, *signals.doubts, *moving.doubts],
        said=said,
        labels=arguments.labels_of(first) if grid is None else None,
        axis=axis,
        clock=signals.clock,
        passed=(signals.passed.get(next(iter(measured))), signals.passed.get("torque")),
        weights=signals.weights,
        wanted=None if isinstance(request.form, StrongForm) else call.get("wanted"),
    )
    if clocks is not None:
        data = clocks.finished(data, axis.torque, call["settings"], partial(_lag_left, request))
    task = ExpandedTask if expansions_of(request) else Task
    if is_bridged and call["settings"] is None and request.lag == 0:
        data = with_read_torque(data, lambda some: task(some, request).run(None))
    data = with_clipped_torque(data, asked, lambda some: _found(task(some, request)))
    return task(data, request)


def _found(task: Task | ExpandedTask) -> Identification:
    """Return what is identified, without looking for what may be missing where that can be left out."""
    return task.run(None, diagnose=False) if isinstance(task, Task) else task.run(None)


def _on_clocks(request: Request, clocks: OwnClocks | None, earlier: Mapping[str, Any] | None) -> Request:
    """Return a request with what is known at every sample on the grid of two clocks, where there are two."""
    if clocks is None:
        return request
    known = partial(clocks.known, earlier=earlier)
    return with_known(request, known, partial(known, over_gaps=False))


def _has_expansions(call: Mapping[str, Any]) -> bool:
    """Return whether a call asks for expansions, whose rows are weighted by the noise of their samples."""
    terms = call["terms"] if isinstance(call["terms"], tuple | list) else ()
    kinds = [*(call[name] for name in COEFFICIENTS), *(term[1] for term in terms if has_kind(term))]
    return any(isinstance(kind, Expansion) for kind in kinds)


def _equation(call: Mapping[str, Any], axis: Axis) -> dict[str, Any]:
    """Return what is asked of the equation, in the units of results."""
    return {
        "inertia": _known("inertia", call["inertia"], axis),
        "damping": _known("damping", call["damping"], axis),
        "stiffness": _known("stiffness", call["stiffness"], axis),
        "terms": call["terms"],
        "lag": call["lag"],
        "quantisation": _in_units_of_results("quantisation", call["quantisation"], axis.angle),
        "period": _in_units_of_results("period", call["period"], axis.angle),
    }


def _lag_left(request: Request, data: Data) -> tuple[float, float]:
    """Return the lag that is left in a record, and its standard error."""
    if isinstance(request.form, StrongForm):
        raise ValueError(  # noqa: TRY004 - a method, but not one that will do
            "align needs the weak form; got the strong form; use WeakForm, or give the offset as a number"
        )
    if expansions_of(request):
        raise ValueError(
            "align must be seconds beside an Expansion; got a word; identify windows with it first, and give settings= of that result, or "
            "the offset that it found"
        )
    looking = replace(request, lag="auto", lag_samples=None, by_record={})
    return lag_found(Task(data, looking).run(None, diagnose=False).settings)


def _sampling(
    given: Mapping[str, Any],
    axis: Axis,
    time_unit: str | None,
    first: npt.ArrayLike,
    samples: npt.NDArray[np.number],
) -> tuple[float, Grid | None, float]:
    """Return the sample period, the grid that samples are to be brought onto where their times are not uniform, and the first time."""
    count = samples.shape[-1]
    try:
        seconds, times = sampled(given, count, axis, time_unit, first)
        arguments.check_no_lost_samples(times, samples)
    except arguments.NotUniformError as error:
        grid = grid_of(error.times)
        return arguments.sample_period(count, delta=grid.period), grid, grid.start
    return seconds, None, arguments.begin_of(times)


def _factor_of(name: str, values: Any, axis: Axis) -> float:
    """Return what a channel of the motion is multiplied by: the angle's factor, or that of the unit which a derivative says."""
    if name == "angle":
        return axis.angle
    said = unit_said(values)
    factor = factor_of_derivative(axis.system, name, said) if said else 1.0
    _check_attribute(name, values, said, factor)
    return factor


def _check_attribute(name: str, values: Any, unit: str, factor: float) -> None:
    """Refuse a unit that only an attribute says, which arithmetic keeps, where numbers would be converted."""
    if factor != 1 and has_unit_in_attributes(values):
        raise UnitError(
            f"{name} must be in the unit of results where only an attribute says {unit!r}: arithmetic keeps attributes, so nobody knows "
            f"whether the numbers still are; pass tvident.Channel({name}, {unit!r}), or .to_numpy() if they were converted"
        )


def _in_units_of_results(name: str, value: float | None, factor: float) -> float | None:
    """Return what was given in the unit of the angle in that of results."""
    return None if value is None else arguments.finite_number(name, value) * factor


def _known(name: str, value: Any, axis: Axis) -> Any:
    """Return a parameter that says its unit in that of results; anything else as it is."""
    said = unit_said(value)
    units = UNITS if axis.system is ROTARY else LINEAR_UNITS
    factor = factor_between(said, units[name], name=f"a known {name}") if said else 1.0
    _check_attribute(name, value, said, factor)
    return value if factor == 1 else scaled(np.asarray(value), factor)
