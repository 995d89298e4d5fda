"""One long record in dask arrays: its blocks, what they say together, and its columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tvident import _core
from tvident._dask.blocks import blocks, imported, joined, rows, tree
from tvident._dask.polynomials import rounding
from tvident._equation import COEFFICIENTS, LINEAR_UNITS, UNITS
from tvident._identify import Held, Long, Request, Span, WeakForm, requested
from tvident._in_pieces import Choices, ToldByWeakForm, chosen, stretches, stretches_told
from tvident._pieces import (
    Columns,
    Given,
    Mean,
    columns_of,
    finished,
    means_of,
    part_alone,
    reach_of,
    with_neighbours,
)
from tvident._status import Status
from tvident._units import ROTARY

_LEAST_BLOCK = 1 << 12
"""Samples of a block: a task costs as much as some thousand of them."""

_REACH = 1 << 13
"""Neighbours of a block that is a record of its own, where its windows are not chosen yet."""

_NEIGHBOURS = 4
"""A block is at least so many times as long as its neighbours on one side."""


@dataclass(frozen=True)
class IdentifiedBlocks:
    """What is to be computed of one record.

    Parameters
    ----------
    columns : mapping of str to dask.array.Array
    settings : mapping or Delayed
    told : Delayed
        Constants by name, and the flags of the record.
    advice : Delayed
        What is worth doing.
    """

    columns: Mapping[str, Any]
    settings: Any
    told: Any
    advice: Any = None


@dataclass(frozen=True)
class _AskedOfDask:
    """What a task makes a long record of: little, and it goes to every worker."""

    request: Request
    samples: int
    given: Given
    step: int

    def long(self, quantisation: float) -> Long:
        """Return the record, without its samples."""
        given = self.given
        propagate = given.nan_policy == "propagate"
        request = replace(self.request, quantisation=quantisation)
        return Long(
            request,
            self.samples,
            given.period,
            given.axis,
            propagate=propagate,
            step=self.step,
            weighted=given.weighted,
        )


class _DaskRecord:
    """Angle, torque and maybe weights of one record, and what is asked for."""

    def __init__(self, channels: Sequence[Any], asked: _AskedOfDask) -> None:
        self.dask, _ = imported()
        self.channels, self.angle, self.asked = channels, channels[0], asked
        self.quantisation = asked.request.quantisation
        # What names, kinds and windows are does not depend on the step that samples were rounded to.
        self.plain = asked.long(0.0)
        if self.quantisation is None:
            self.quantisation = rounding(self.angle)

    def held(self, spans: Sequence[Span]) -> list[Any]:
        """Return some samples of all channels."""
        _, array = imported()
        return [array.concatenate([one[slice(*span)] for span in spans]) for one in self.channels]

    def blocks(self, least: int) -> list[Span]:
        """Return the blocks that are worked on."""
        return blocks(self.angle.chunks[-1], max(_LEAST_BLOCK, least))

    def columns(self, parts: Sequence[Any], found: Sequence[Span]) -> Columns:
        """Return the columns of all blocks."""
        counts = [rows(block, self.asked.step) for block in found]
        names = [*self.plain.names, *self.plain.known]
        kinds: dict[str, Any] = {}
        for name in names:
            kinds |= {name: np.float64, f"{name}_stderr": np.float64}
        kinds |= {"condition": np.float64, "residual_std": np.float64, "order": np.uint8, "status": np.uint16}
        return {name: joined([part[name] for part in parts], counts, kind) for name, kind in kinds.items()}


def record_of(channels: Sequence[Any], given: Given, step: int) -> IdentifiedBlocks:
    """Return what is to be computed of one record."""
    request = requested(given.method, given.equation, given.settings, 1 / given.period)
    record = _DaskRecord(channels, _AskedOfDask(request, channels[0].shape[-1], given, step))
    found = _identified(record, request)
    return found if isinstance(request.form, WeakForm) or given.weighted else _with_advice(record, found)


def _with_advice(record: _DaskRecord, found: IdentifiedBlocks) -> IdentifiedBlocks:
    """Return what the weak form says of stretches of a record in strong form, beside what is computed."""
    spans, step = stretches_told(record.asked.samples), record.asked.step
    names = [*(f"{name}{end}" for name in COEFFICIENTS for end in ("", "_stderr")), "status"]
    channels = [record.held([span]) for span in spans]
    rows = [
        {name: found.columns[name][-(-first // step) : -(-end // step)] for name in names if name in found.columns}
        for first, end in spans
    ]
    told = record.dask.delayed(_told_by_weak_form, pure=True)
    return replace(found, advice=told(channels, rows, spans, record.asked, record.quantisation))


def _told_by_weak_form(
    channels: Sequence[Sequence[Any]],
    rows: Sequence[Columns],
    spans: Sequence[Span],
    asked: _AskedOfDask,
    quantisation: float,
) -> list[str]:
    long, given = asked.long(quantisation), asked.given
    places = {span: place for place, span in enumerate(spans)}
    told = ToldByWeakForm(
        long,
        given,
        lambda some: _held(channels[places[some[0]]], some),
        lambda span: rows[places[span]],
        0.0,
        UNITS if given.axis.system is ROTARY else LINEAR_UNITS,
    )
    return told.advice(asked.samples)


def _identified(record: _DaskRecord, request: Request) -> IdentifiedBlocks:
    if not isinstance(request.form, WeakForm) and record.plain.is_windowed:
        return _windowed(record)
    if not isinstance(request.form, WeakForm) and record.plain.is_constant:
        return _constant(record)
    return _alone(record)


def _windowed(record: _DaskRecord) -> IdentifiedBlocks:
    """Windows of the strong form: blocks have the bits of the whole record."""
    dask, plain, asked = record.dask, record.plain, record.asked
    spans = plain.spans_of_scatter()
    factors = dask.delayed(_factors, pure=True)(record.held(spans), spans, asked, record.quantisation)
    work = dask.delayed(_windows, pure=True)
    found = record.blocks(_reach(plain, asked.samples))
    parts = []
    for block in found:
        span = plain.around(block)
        parts.append(work(record.held([span]), (span, block), factors, asked, record.quantisation))
    settings = dask.delayed(_with_factors, pure=True)(factors, asked, record.quantisation)
    return IdentifiedBlocks(record.columns(parts, found), settings, dask.delayed(({}, 0)))


def _reach(plain: Long, samples: int) -> int:
    first, end = plain.around((samples, samples))
    return end - first


def _factors(channels: Sequence[Any], spans: Sequence[Span], asked: _AskedOfDask, quantisation: float) -> list[float]:
    return asked.long(quantisation).factors(_held(channels, spans), 1)


def _with_factors(factors: Sequence[float], asked: _AskedOfDask, quantisation: float) -> dict[str, Any]:
    return asked.long(quantisation).settings(factors)


def _held(channels: Sequence[Any], spans: Sequence[Span]) -> Held:
    angle, torque, *weights = (np.ascontiguousarray(one) for one in channels)
    return Held(angle, torque, spans, *weights)


def _windows(
    channels: Sequence[Any],
    places: tuple[Span, Span],
    factors: Sequence[float],
    asked: _AskedOfDask,
    quantisation: float,
) -> Columns:
    """Return the columns of one block, on one thread: dask has others."""
    span, block = places
    long, held = asked.long(quantisation), _held(channels, [span])
    if asked.given.nan_policy == "raise" and not held.is_whole:
        raise ValueError(f"samples {block[0]} to {block[1]} must be finite; some are not; use nan_policy='omit'")
    return columns_of(long.windows(held, block, factors, 1))


def _constant(record: _DaskRecord) -> IdentifiedBlocks:
    """Constants of the strong form: the equations of blocks add up, in a tree."""
    dask, plain, asked = record.dask, record.plain, record.asked
    found = record.blocks(_reach(plain, asked.samples))
    rows_of, merged = dask.delayed(_rows, pure=True), dask.delayed(_core.merged_rows, pure=True)
    parts = []
    for block in found:
        span = plain.around(block)
        parts.append((record.held([span]), (span, block), asked, record.quantisation))
    total = tree([rows_of(*part) for part in parts], merged)
    spans = plain.spans_of_scatter()
    told = dask.delayed(_constants, pure=True)(record.held(spans), spans, total, asked, record.quantisation)
    everywhere = dask.delayed(_everywhere, pure=True)
    columns = record.columns([everywhere(*part, told) for part in parts], found)
    return IdentifiedBlocks(columns, plain.settings(), told[:2])


def _rows(channels: Sequence[Any], places: tuple[Span, Span], asked: _AskedOfDask, quantisation: float) -> Any:
    span, block = places
    return asked.long(quantisation).rows(_held(channels, [span]), block, 1)


def _constants(
    channels: Sequence[Any], spans: Sequence[Span], total: Any, asked: _AskedOfDask, quantisation: float
) -> tuple[dict[str, tuple[float, float]], int, float, float]:
    """Return the constants of the record, its flags, the condition number and the standard deviation of the residuals."""
    long = asked.long(quantisation)
    return long.constants(_held(channels, spans), total, 1)


def _everywhere(
    channels: Sequence[Any], places: tuple[Span, Span], asked: _AskedOfDask, quantisation: float, told: Any
) -> Columns:
    """Return the columns of a block whose parameters are those of the record."""
    span, block = places
    constants, flags, condition, residual = told
    long = asked.long(quantisation)
    polynomials = long.polynomials(_held(channels, [span]), block)
    count = polynomials.status.size
    status = polynomials.status & ~np.uint16(Status.INVALID)
    if flags & Status.RANK_DEFICIENT:
        status |= np.uint16(Status.INVALID | Status.RANK_DEFICIENT)
    columns: Columns = {}
    for name, (value, error) in {**constants, **long.values_known()}.items():
        columns |= {name: np.full(count, value), f"{name}_stderr": np.full(count, error)}
    columns |= {"condition": np.full(count, condition), "residual_std": np.full(count, residual)}
    return columns | {"order": polynomials.order, "status": status}


def _alone(record: _DaskRecord) -> IdentifiedBlocks:
    """Blocks that are records of their own; constants are put together in a tree, and windows corrected for them."""
    dask, asked = record.dask, record.asked
    given = asked.given
    choices: Any = None
    reach = _REACH
    if given.frozen is not None:
        reach = reach_of(given.frozen)
        choices = dask.delayed(Choices(dict(given.frozen), 0, []))
    elif not isinstance(asked.request.form, WeakForm):
        reach = reach_of(record.plain.settings())
    found = record.blocks(_NEIGHBOURS * reach)
    if isinstance(asked.request.form, WeakForm) and choices is None and len(found) > 1:
        spans = stretches(asked.samples, asked.step)
        each = [record.held([span]) for span in spans]
        choices = dask.delayed(_choices, pure=True)(each, spans, given)
    work, finish = dask.delayed(_block_alone, pure=True), dask.delayed(_finished, pure=True)
    parts = []
    for block in found:
        span = with_neighbours(block, reach, asked.samples, asked.step)
        parts.append(work(record.held([span]), (span, block), choices, given, asked.step))
    notes = tree([dask.delayed(_listed, pure=True)(part) for part in parts], dask.delayed(_together, pure=True))
    means = dask.delayed(means_of, pure=True)(notes)
    columns = record.columns([finish(part, means) for part in parts], found)
    told = dask.delayed(_told, pure=True)(notes, means, choices)
    settings = dask.delayed(_settings, pure=True)(notes if choices is None else [], choices)
    return IdentifiedBlocks(columns, settings, told, dask.delayed(_advice, pure=True)(choices))


def _advice(choices: Choices | None) -> list[str]:
    return [] if choices is None else choices.advice


def _choices(each: Sequence[Sequence[Any]], spans: Sequence[Span], given: Given) -> Choices:
    """Return what stretches choose."""
    read = dict(zip(spans, each, strict=True))
    return chosen(spans, lambda some: _held(read[some[0]], some), given.identified, given.period)


def _block_alone(
    channels: Sequence[Any], places: tuple[Span, Span], choices: Choices | None, given: Given, step: int
) -> tuple[Columns, dict[str, Any]]:
    span, block = places
    settings = None if choices is None else choices.settings
    held = _held(channels, [span])
    result = given.identified(held, chosen=settings, step=step, wanted=block)
    columns, note = part_alone(result, span, block, step)
    return columns, note if choices is not None else note | {"settings": result.settings}


def _settings(notes: Sequence[Mapping[str, Any]], choices: Choices | None) -> dict[str, Any]:
    """Return what was chosen for all blocks, or else by the only one."""
    return dict(notes[0]["settings"] if choices is None else choices.settings)


def _listed(part: tuple[Columns, dict[str, Any]]) -> list[dict[str, Any]]:
    return [part[1]]


def _together(one: list[dict[str, Any]], other: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return one + other


def _finished(part: tuple[Columns, dict[str, Any]], means: Mapping[str, Mean]) -> Columns:
    return finished(*part, means)


def _told(notes: Sequence[Mapping[str, Any]], means: Mapping[str, Mean], choices: Choices | None) -> Any:
    """Return the constants of the record, and its flags."""
    status = 0 if choices is None else choices.record_status
    for note in notes:
        status |= note["record_status"]
    if not all(mean.agree for mean in means.values()):
        status |= int(Status.KIND_CONTRADICTED)
    return {name: (mean.value, mean.error) for name, mean in means.items()}, status
