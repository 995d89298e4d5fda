"""JSON: an object for every sample, line by line or in a list, or an object that holds the channels."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from tvident._files.arrays import numeric
from tvident._files.cells import number
from tvident._files.channels import Channels, FileError, Say, check_count
from tvident._files.headers import not_a_number
from tvident._files.names import printable
from tvident._files.rows import Numbers
from tvident._files.text import in_seconds, read_whole
from tvident._files.times import TimeColumn, instant
from tvident._units import named_unit, with_unit

_LINES = 'one object in every line, as {"time": 0.001, "angle": 0.1, "torque": 2.0}'

_DEEPEST = 20
"""Objects in objects."""

_NUMBERS = {int, float, bool}

_UNITS = ("unit", "units")
"""Members that hold the units of those beside them."""


def read_json(path: Path, say: Say) -> Channels:
    """Read samples, or channels, that are written as JSON; members of objects in objects have names joined by dots."""
    text = read_whole(path)
    if not text.strip():
        return {}
    try:
        whole = _parsed(text, 1)
    except json.JSONDecodeError as error:
        lines = text.split("\n")
        if error.pos >= len(text.rstrip()) and len([line for line in lines if line.strip()]) <= 1:
            raise FileError(f"JSON must be whole; this one ends in the middle ({error.msg}); copy it again") from None
        return samples_of(_of_lines(lines, say), say)
    except RecursionError:
        raise FileError(f"objects must be at most {_DEEPEST} deep; these are deeper; write {_LINES}") from None
    if isinstance(whole, list) and whole and all(isinstance(one, Mapping) for one in whole):
        return samples_of(list(enumerate(whole, 1)), say)
    if isinstance(whole, Mapping) and isinstance(whole.get("columns"), list) and isinstance(whole.get("data"), list):
        # As pandas writes a table that is split.
        names = [str(name) for name in whole["columns"]]
        return samples_of(
            [(place, dict(zip(names, row, strict=False))) for place, row in enumerate(whole["data"], 1)], say
        )
    if isinstance(whole, Mapping) and not any(isinstance(one, list | Mapping) for one in whole.values()):
        return samples_of([(1, whole)], say)
    if isinstance(whole, Mapping | list):
        return numeric(_of_columns("", whole if isinstance(whole, Mapping) else {"": whole}, say), say)
    raise FileError(f"JSON must hold samples; this one holds {printable(str(whole), 40)} alone; write {_LINES}")


class _TwiceError(Exception):
    """A name that two members of an object have."""


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise _TwiceError(next(name for name in names if names.count(name) > 1))
    return found


_DECODER = json.JSONDecoder(object_pairs_hook=_unique)
"""Made once: a decoder of its own for every line takes as long as the line."""


def _parsed(text: str, place: int) -> Any:
    """Return what a text of JSON holds; no member may have the name of another beside it."""
    try:
        return _DECODER.decode(text)
    except _TwiceError as error:
        raise FileError(
            f"names of an object must differ; from line {place} on one has '{printable(str(error), 40)}' twice; rename one"
        ) from None
    except ValueError as error:
        if isinstance(error, json.JSONDecodeError):
            raise
        raise FileError(
            f"numbers must be those of 64 bits; one from line {place} on has too many digits; write it shorter"
        ) from None


def _of_lines(lines: Sequence[str], say: Say) -> list[tuple[int, Any]]:
    """Return the object of every line with its number."""
    found: list[tuple[int, Any]] = []
    last = max(place for place, line in enumerate(lines, 1) if line.strip())
    for place, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            found.append((place, _parsed(line, place)))
        except json.JSONDecodeError as error:
            if place == last == len(lines) and found:
                say(f"line {place} has no end and is no whole object: not read, since the file may have been cut there")
                continue
            raise FileError(f"JSON must hold {_LINES}; line {place} does not: {error.msg}; repair it") from None
        except RecursionError:
            raise FileError(
                f"objects must be at most {_DEEPEST} deep; line {place} is deeper; write {_LINES}"
            ) from None
    return found


def samples_of(rows: Sequence[tuple[int, Any]], say: Say) -> Channels:
    """Return the channels of samples, each an object with its place: NaN where one lacks a member that others have."""
    even = _of_even_samples([one for _, one in rows])
    if even is not None:
        return even
    columns: dict[str, dict[int, Any]] = {}
    for row, (place, one) in enumerate(rows):
        if not isinstance(one, Mapping | list):
            raise FileError(f"JSON must hold {_LINES}; {place} is {printable(str(one), 40)}; repair it")
        for name, value in _members("", one, 0):
            columns.setdefault(name, {})[row] = value
        check_count(len(columns))
    channels: Channels = {}
    for name, cells in columns.items():
        lacking = len(rows) - len(cells)
        read = _column(name, cells, [place for place, _ in rows], say)
        if read is None:
            continue
        if lacking:
            say(f"{lacking} of {len(rows)} samples have no '{printable(name, 40)}': missing values")
        channels[read[0]] = read[1]
    return channels


def _of_even_samples(rows: Sequence[Any]) -> Channels | None:
    """Return the channels of samples that all have the same members, numbers alone; None where they are anything else.

    Most are such, and are read in a fifth of the time.
    """
    if not rows or type(rows[0]) is not dict or not rows[0]:
        return None
    names = list(rows[0])
    check_count(len(names))
    if any(type(one) is not dict or one.keys() != rows[0].keys() for one in rows):
        return None
    channels: Channels = {}
    for name in names:
        samples = _of_numbers([one[name] for one in rows])
        if samples is None:
            return None
        channels[name] = samples
    return channels


def _of_numbers(cells: Sequence[Any]) -> Numbers | None:
    """Return samples that are all numbers; None where one is anything else, or too large for a sample."""
    if set(map(type, cells)) <= _NUMBERS:
        with suppress(OverflowError):
            return np.array(cells, np.float64)
    return None


def _members(prefix: str, value: Any, depth: int) -> Iterable[tuple[str, Any]]:
    """Give what is no object and no list, with the names of what it is in before its own."""
    if depth > _DEEPEST:
        raise FileError(f"objects must be at most {_DEEPEST} deep; '{printable(prefix, 40)}' is deeper; write {_LINES}")
    if not isinstance(value, Mapping | list):
        yield prefix, value
        return
    pairs = value.items() if isinstance(value, Mapping) else enumerate(value)
    for name, one in pairs:
        yield from _members(f"{prefix}.{name}" if prefix else str(name), one, depth + 1)


def _column(name: str, cells: Mapping[int, Any], places: Sequence[int], say: Say) -> tuple[str, Numbers] | None:
    """Return the name and the samples of a column; None where it holds words, which is said."""
    if len(cells) == len(places):
        samples = _of_numbers([cells[row] for row in range(len(places))])
        if samples is not None:
            return name, samples
    found = np.full(len(places), np.nan)
    words = {row: cell.strip() for row, cell in cells.items() if isinstance(cell, str)}
    values = {row: number(cell, comma=False) for row, cell in words.items()}
    odd = [row for row, value in values.items() if value is None]
    for row, cell in cells.items():
        if isinstance(cell, bool | int | float):
            try:
                found[row] = cell
            except OverflowError:
                raise FileError(not_a_number(places[row], name, f"{str(cell)[:20]}…")) from None
        elif isinstance(cell, str) and values[row] is not None:
            found[row] = values[row]
    if not odd:
        return name, found
    if np.isfinite(found).any():
        raise FileError(not_a_number(places[odd[0]], name, words[odd[0]]))
    if any(instant(words[row]) is None for row in odd):
        say(f"column '{printable(name, 40)}': not read, it holds words: '{printable(words[odd[0]], 40)}'")
        return None
    return _of_times(name, {row: words[row] for row in odd}, found, say)


def _of_times(name: str, cells: Mapping[int, str], found: Numbers, say: Say) -> tuple[str, Numbers]:
    """Return the name and the samples of a column of times."""
    times = TimeColumn(list(cells.values()))
    try:
        for row, cell in cells.items():
            found[row] = times.seconds(cell)
    except ValueError as error:
        raise FileError(
            f"times must all be of one form; '{printable(name, 40)}' has '{printable(str(error), 40)}', too; repair it"
        ) from None
    if times.is_doubtful or times.may_count_frames:
        raise FileError(
            f"times must say what they mean; '{printable(name, 40)}' has '{times.first}'; write 2024-12-31T12:30:00.5"
        )
    return in_seconds(name, times, found, say)


def _of_columns(prefix: str, members: Mapping[str, Any], say: Say, depth: int = 0) -> Iterable[tuple[str, Any]]:
    """Give lists of numbers and single numbers by name, with the units that stand beside them."""
    if depth > _DEEPEST:
        raise FileError(f"objects must be at most {_DEEPEST} deep; '{printable(prefix, 40)}' is deeper; write {_LINES}")
    units = next((one for name, one in members.items() if name.lower() in _UNITS and isinstance(one, Mapping)), {})
    for name, value in members.items():
        if value is units and units:
            continue
        unit = units.get(name)
        full = f"{prefix}{name}"
        called = with_unit(full, unit) if isinstance(unit, str) and not named_unit(name)[1] else full
        # pandas numbers the samples of a column as members of an object.
        taken = (
            list(value.values())
            if isinstance(value, Mapping) and list(value) == [*map(str, range(len(value)))]
            else value
        )
        if isinstance(taken, Mapping):
            yield from _of_columns(f"{full}.", taken, say, depth + 1)
        elif isinstance(taken, list) and not any(isinstance(one, list | Mapping) for one in taken):
            read = _column(called, dict(enumerate(taken)), range(1, len(taken) + 1), say)
            yield from [] if read is None else [read]
        elif isinstance(taken, list):
            yield from _of_lists(called, taken, say)
        elif isinstance(taken, bool | int | float):
            yield called, np.float64(taken)


def _of_lists(name: str, lists: Sequence[Any], say: Say) -> Iterable[tuple[str, Any]]:
    """Give lists of lists as a matrix; where they are no such, it is said."""
    try:
        matrix = np.array(lists, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        say(f"not read: '{printable(name, 40)}', its lists are no rows of numbers")
        return
    yield name, matrix
