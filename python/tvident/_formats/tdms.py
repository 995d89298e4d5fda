"""Channels of TDMS files of National Instruments."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Real
from typing import Any

from tvident._formats.groups import TIME, Group, axis_of, named
from tvident._formats.tdms_parts import Parts, parts_noted, parts_of
from tvident._formats.told import Logged, Remark, cut, in_words
from tvident._units import UnitError, factor_between

_UNITS = ("unit_string", "ni_unitdescription", "unit", "units", "y_unit_label", "unit_description")
"""Properties that hold a unit, in small letters."""

_UNSET = "1904-01-02"
"""A start before it was not set."""

_SAME_START = 1e-3
"""Parts of a sample period that two starts may differ by and still be one."""

_ROUNDED = 1e-7
"""Part of a number, a sample period or a factor, that rounding may make of it."""

_GOES_ON = 0.5
"""Parts of a sample period that what was appended may begin beside the next sample and still go on."""


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every channel of numbers with its unit, and the times of those that know their sample period."""
    import numpy as np  # noqa: PLC0415 - within the limits
    from nptdms import TdmsFile  # noqa: PLC0415 - an extra

    told = Logged()
    logging.getLogger("nptdms").addHandler(told)
    with parts_noted() as every:
        file = TdmsFile.read(path)
    if file.file_status.incomplete_final_segment or any("incomplete" in one for one in told.messages):
        skipped.append("what was cut off at the end of the file (channels may have different lengths)")
    channels = [(one, parts_of(every, one)) for group in file.groups() for one in group.channels()]
    read = [(one, parts, _samples(one, parts, told, skipped)) for one, parts in channels]
    # What begins later says nothing of when the first part began, if that does not.
    starts = [start for _, parts, samples in read if samples is not None for _, start, _ in _begins(parts)[:1] if start]
    starts += [
        samples[0] for _, _, samples in read if samples is not None and samples.dtype.kind == "M" and samples.size
    ]
    groups: list[Group] = []
    for channel, parts, samples in read:
        if samples is None:
            continue
        time, axis, unit, taken = None, TIME, _unit(channel.properties), samples
        late = next((first for first, properties in parts if _unit(properties)), 0)
        if late:
            skipped.append(
                Remark(
                    f"channel {cut(channel.name)}: its unit, {cut(unit)}, was written at sample {late}, and is taken for all of it"
                )
            )
        if samples.dtype.kind == "M":
            unit = "s"
            taken = (samples - min(starts)) / np.timedelta64(1, "s") if samples.size else samples.astype(float)
        elif samples.size:
            time, axis = _times(channel, samples.size, _begins(parts), starts, skipped)
        part = Group(channel.group_name, time, [(channel.name, unit, taken)], axis)
        before = next(
            (one for one in groups if one.name == part.name and one.axis == axis and _same(one.time, time)), None
        )
        if before is None:
            groups.append(part)
        else:
            before.channels += part.channels
    yield from named(groups, skipped)


def _samples(channel: Any, parts: Parts, told: Logged, skipped: list[str]) -> Any:
    """Return the samples of a channel; None where they cannot be read as they are meant, which is said."""
    changed = _changed(parts)
    if changed:
        skipped.append(f"{cut(channel.name)} ({changed}; read the parts one by one)")
        return None
    told.messages.clear()
    try:
        samples = channel[:]
    except Exception as error:  # noqa: BLE001 - of one channel; the others may be whole
        skipped.append(f"{cut(channel.name)} ({in_words(error)})")
        return None
    if told.messages:
        # Raw numbers come back where nothing knows how to scale them.
        skipped.append(f"{cut(channel.name)} ({cut(told.messages[0])})")
    elif samples.dtype.kind in "biufM":
        return samples
    else:
        skipped.append(f"{cut(channel.name)} ({'complex' if samples.dtype.kind == 'c' else 'no numbers'})")
    return None


def _changed(parts: Parts) -> str:
    """Return what of the parts of a channel is not the same in all, so that they are not one channel; empty where all are one."""
    kinds: tuple[tuple[str, Callable[[Mapping[str, Any]], Any]], ...] = (
        ("unit", _unit),
        ("sample period", lambda properties: properties.get("wf_increment")),
        (
            "scaling",
            lambda properties: {name: value for name, value in properties.items() if name.startswith("NI_Scale[")},
        ),
    )
    for what, of in kinds:
        # What was written later may have been known later.
        said = [value for value in (of(properties) for _, properties in parts) if value]
        other = next((value for value in said if not _alike(value, said[0])), None)
        if other is not None:
            shown = f": {said[0]}, then {other}" if isinstance(other, str | float) else ""
            return f"it was appended to with another {what}{shown}"
    units = [_unit(properties) for _, properties in parts]
    if units[0] and not all(units):
        return f"it was appended to without a unit, after {units[0]}"
    return ""


def _alike(value: Any, other: Any) -> bool:
    """Return whether two parts mean the same by a property: numbers but for rounding, units by what they are."""
    if isinstance(value, Mapping) and isinstance(other, Mapping):
        return value.keys() == other.keys() and all(_alike(one, other[name]) for name, one in value.items())
    if str(value) == str(other):
        return True
    if isinstance(value, Real) and isinstance(other, Real):
        return math.isclose(value, other, rel_tol=_ROUNDED)
    try:
        return factor_between(str(value), str(other), name="unit") == 1
    except UnitError:
        return False


def _number(value: Any) -> float | None:
    """Return the finite number that a property is; None where it is another, or words."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def _begins(parts: Parts) -> list[tuple[int, Any, float]]:
    """Return the first sample of every part whose beginning is another than that of the part before: its number, start and offset.

    The start is None where the file does not say any.
    """
    found: list[tuple[int, Any, float]] = []
    for first, properties in parts:
        start = properties["wf_start_time"] if _has_start(properties) else None
        begin = (start, _number(properties.get("wf_start_offset") or 0.0) or 0.0)
        if not found or begin != found[-1][1:]:
            found.append((first, *begin))
    return found


def _times(
    channel: Any, samples: int, begun: Sequence[tuple[int, Any, float]], starts: Sequence[Any], skipped: list[str]
) -> tuple[Any, tuple[str, str]]:
    """Return the times of a channel, or what else its samples lie at, with name and unit; None where the file does not say."""
    import numpy as np  # noqa: PLC0415 - within the limits

    properties = channel.properties
    period = properties.get("wf_increment")
    if period is None:
        return None, TIME
    axis = axis_of(str(properties.get("wf_xname") or ""), str(properties.get("wf_xunit_string") or ""))
    given, period = period, _number(period)
    if period is None or period <= 0:
        skipped.append(
            Remark(f"channel {cut(channel.name)}: its sample period is {cut(str(given))}, so it has no times")
        )
        return None, TIME
    offset = properties.get("wf_start_offset")
    if offset not in {None, ""} and _number(offset) is None:
        skipped.append(Remark(f"channel {cut(channel.name)}: its offset is {cut(str(offset))}, which is taken as 0"))
    time = begun[0][2] + period * np.arange(samples)
    if axis[0] != TIME[0]:
        return time, axis
    second = 1 / factor_between(axis[1], "s", name="time")

    def moved_to(start: Any) -> float:
        if start is None:
            return 0.0
        zero = min(starts or [one for _, one, _ in begun if one is not None])
        moved = second * float((start - zero) / np.timedelta64(1, "s"))
        return moved if abs(moved) > _SAME_START * period else 0.0

    begins = [(first, start is not None, moved_to(start) + offset) for first, start, offset in begun]
    skipped += [
        Remark(
            f"channel {cut(channel.name)}: it was appended to {pause / second:.6g} s after its end, as its times say"
        )
        for pause in _pauses(time, begins, _GOES_ON * period, has_zero=bool(starts))
    ]
    return time, axis


def _pauses(time: Any, begins: Sequence[tuple[int, bool, float]], near: float, *, has_zero: bool) -> Iterator[float]:
    """Move the times of every part to where it begins, and give the pauses before those that do not go on.

    Parts are their first sample, whether their start is known, and the time at which they begin. Those whose start is not known begin by
    their offsets, and nothing says what lies between them and others.
    """
    first, was_known, begin = begins[0]
    time += begin - time[0]
    placed = {was_known: (begin, begin)}
    for first, is_known, begin in begins[1:]:
        usual, pause = float(time[first]), 0.0
        if is_known in placed and (is_known or not was_known):
            there, then = placed[is_known]
            pause = there + begin - then - usual
        elif is_known and has_zero:
            pause = max(begin - usual, 0.0)
        if abs(pause) > near:
            time[first:] += pause
            yield pause
        if abs(pause) > near or is_known not in placed or (was_known and not is_known):
            placed[is_known] = (float(time[first]), begin)
        was_known = is_known


def _has_start(properties: Mapping[str, Any]) -> bool:
    import numpy as np  # noqa: PLC0415 - within the limits

    start = properties.get("wf_start_time")
    # Text is no time, and the first instant of 1904 stands for none.
    is_set = isinstance(start, np.datetime64) and bool(start >= np.datetime64(_UNSET))
    return is_set and bool(properties.get("wf_increment"))


def _unit(properties: Mapping[str, Any]) -> str:
    lower = {str(name).lower(): value for name, value in properties.items()}
    return next((str(lower[name]) for name in _UNITS if lower.get(name)), "")


def _same(time: Any, other: Any) -> bool:
    if time is None or other is None:
        return time is other
    return len(time) == len(other) and bool(abs(time - other).max() <= 0)
