"""Many records of different lengths: each is identified, and what they share is estimated from all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import COEFFICIENTS, Term
from tvident._identify.earlier import with_earlier_kinds
from tvident._identify.short_records import CHANNELS, OF_SAMPLES, without_numbers
from tvident._results import Identification, IdentifiedRecords, Shared, covariance_between, with_shared
from tvident._status import Status

Array = npt.NDArray[np.float64]
Single = Callable[..., Identification]

_CHANNELS = (*CHANNELS, *OF_SAMPLES)
"""Arguments that have a value for every sample, and so one array a record."""

_OTHERS = ("sample_rate", "delta", "lag", "inertia", "damping", "stiffness", "settings")
"""Arguments that may be given for every record."""

_OF_RECORDS = frozenset({"settings", "sample_rate", "delta", "lag"})
"""Those of which a list has one for every record, and nothing else."""

_RATES = ("sample_rate", "delta")
"""Those that may be two numbers, of the angle and of the torque."""

_PAIR = 2
"""Clocks: that of the angle and that of the torque."""

_MOST_CORRELATED = 0.9999
"""Constants of one record are taken for no more correlated than this, so that rounding makes no variance negative."""

_CHANCE = 3.09
"""Standard deviations that one of a thousand normal numbers exceeds."""


def names_shared(share: str | Sequence[str]) -> tuple[str, ...]:
    """Return what records share, by name, each once."""
    names = tuple(share) if arguments.is_several(share) else (share,)
    return tuple(dict.fromkeys(arguments.one_of("share", name, COEFFICIENTS) for name in names))


def calls_of_records(call: Mapping[str, Any], share: Sequence[str]) -> list[dict[str, Any]] | None:
    """Return one call for every record; None where records are of one length and nothing is shared, or there is one alone.

    Raises
    ------
    ValueError
        If channels have different numbers of records, or what is to be shared cannot be.
    """
    motion = next((name for name in _CHANNELS if call[name] is not None), "torque")
    count = _records(motion, call[motion])
    if share:
        count = count or _records_of_batch(motion, call[motion])
        _check_shared(share, call)
    elif count is None or not (_differ(call) or _have_two_clocks(call)):
        return None
    _check_each_is_one(call)
    for name in _RATES:
        if _is_two_rates(call[name]) and (count != _PAIR or _lengths_differ(call)):
            call = {**call, name: [call[name]] * count}
    calls: list[dict[str, Any]] = [{} for _ in range(count)]
    for name, value in call.items():
        for place, one in enumerate(_each(name, value, count)):
            calls[place][name] = one
    return calls


def _differ(call: Mapping[str, Any]) -> bool:
    """Return whether records have different lengths, or a channel that others have not: they are no batch."""
    lists = [call[name] for name in _CHANNELS if _records(name, call[name]) is not None]
    has_gaps = any(one is None for each in lists for one in each)
    return has_gaps or len({np.shape(one)[-1] for one in lists[0]}) > 1


def _have_two_clocks(call: Mapping[str, Any]) -> bool:
    """Return whether angle and torque of records have each a clock of their own: such records are no batch."""
    of_each = [one for name in (*_RATES, "t") if isinstance(call[name], list) for one in call[name]]
    return any(_is_two_rates(one) or _is_two_times(one) for one in of_each) or (
        any(_is_two_rates(call[name]) for name in _RATES) and _lengths_differ(call)
    )


def _is_two_rates(value: Any) -> bool:
    """Return whether a value is the rates of angle and torque."""
    return isinstance(value, tuple) and len(value) == _PAIR and all(np.ndim(one) == 0 for one in value)


def _is_two_times(value: Any) -> bool:
    """Return whether a value is the times of angle and those of torque."""
    return isinstance(value, tuple) and len(value) == _PAIR and all(np.ndim(one) > 0 for one in value)


def _lengths_differ(call: Mapping[str, Any]) -> bool:
    """Return whether the torque of a record has another length than its angle, as with another rate."""
    angles, torques = call["angle"], call["torque"]
    return angles is not None and any(
        np.shape(one) != np.shape(other) for one, other in zip(angles, torques, strict=False)
    )


def identify_records(
    single: Single, calls: Sequence[Mapping[str, Any]], share: Sequence[str], progress: arguments.Progress
) -> IdentifiedRecords:
    """Identify every record, and what they share from all of them."""
    sizes = [int(np.size(call["torque"])) for call in calls]
    rounds = 2 + len(share) if share else 1
    total, before = rounds * sum(sizes), 0
    with arguments.reporter(progress, "identification") as told:
        report = None if told is None else arguments.WatchedProgress(told)

        def every(change: Callable[[int], Mapping[str, Any]]) -> list[Identification]:
            nonlocal before
            found = []
            for place, own in enumerate(calls):
                call, begin = {**own, **change(place)}, before
                tell = None if report is None else lambda done, _, begin=begin: report(begin + done, total)
                try:
                    found.append(single(**{**call, "progress": tell}))
                except (ValueError, TypeError) as error:
                    if report is not None and report.error is error:
                        raise
                    changed = [*calls[:place], call, *calls[place + 1 :]]
                    short = without_numbers(single, changed, place, error) if isinstance(error, ValueError) else None
                    if short is not None:
                        found.append(short)
                        before += sizes[place]
                        continue
                    if place == 0 and _is_of_all(str(error), calls):
                        raise
                    kind = ValueError if isinstance(error, ValueError) else TypeError
                    raise kind(f"{error} (record {place} of {len(calls)})") from error
                before += sizes[place]
            return found

        alone = every(lambda _: dict.fromkeys(share, "constant"))
        if not share:
            return IdentifiedRecords(alone)
        shared = _merged(alone, share)
        if not np.isfinite(shared.covariance).all():
            return IdentifiedRecords(alone, shared)
        # What is unknown beside constants has the kinds that it has beside them.
        terms = [_terms_of_kinds(call["terms"], one.settings) for call, one in zip(calls, alone, strict=True)]
        known = every(lambda place: {**shared.values, "terms": terms[place]})
        errors = {name: error for name, (_, error) in shared.constants.items()}
        moved = {
            name: every(
                lambda place, name=name: {  # type: ignore[misc]
                    **shared.values,
                    "terms": terms[place],
                    name: shared.values[name] + errors[name],
                    "settings": known[place].settings,
                }
            )
            for name in share
        }
    together = [
        with_shared(one, shared, {name: moved[name][place] for name in share}) for place, one in enumerate(known)
    ]
    return IdentifiedRecords(together, shared)


def _terms_of_kinds(terms: Sequence[Any] | None, settings: Mapping[str, Any]) -> Sequence[Any]:
    """Return terms, each with the kind that a result decided upon where none was given."""
    if terms is None and not settings.get("own_terms"):
        return [tuple(pair) for pair in settings["terms"]]
    return with_earlier_kinds([terms] if isinstance(terms, str | Term) else terms or (), settings)


def _is_of_all(error: str, calls: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether an error begins with the name of an argument that all records have in common, and speaks of no record."""
    if "record" in error:
        return False
    name = "terms" if error.startswith("a term ") else error.partition(" ")[0]
    return name in calls[0] and all(call[name] is calls[0][name] for call in calls)


def _records(name: str, values: Any) -> int | None:
    """Return how many records a list holds, of which any may be None; None where it is none, or one record of numbers."""
    if not isinstance(values, list | tuple) or not values:
        return None
    two_clocks = name == "t" and isinstance(values, list)
    for place, one in enumerate(values):
        if one is not None and not (two_clocks and _is_two_times(one)) and not _shape(f"{name}[{place}]", one):
            return None
    return len(values)


def _shape(name: str, values: Any) -> tuple[int, ...]:
    try:
        return np.shape(values)
    except ValueError:
        raise ValueError(
            f"{name} must be a regular array of numbers; got {arguments.shown(values)}; where records have different lengths, give one "
            f"list of them, each an array of its own: [first, second]"
        ) from None


def _check_each_is_one(call: Mapping[str, Any]) -> None:
    """Check that what a list holds of a channel is one record each."""
    for name in _CHANNELS:
        for place, one in enumerate(call[name] if _records(name, call[name]) else ()):
            if one is None or (name == "t" and _is_two_times(one)):
                continue
            shape = _shape(f"{name}[{place}]", one)
            if len(shape) > 1 and shape[1:] != (1,):
                raise ValueError(
                    f"every record of a list must have one dimension where lengths differ or something is shared; got {name}[{place}] of "
                    f"shape {shape}; put its records into the list, one after the other"
                )


def _records_of_batch(name: str, values: Any) -> int:
    """Return how many records there are along the first axis of an array."""
    shape = arguments.channel(name, values).shape
    if len(shape) != 2:  # noqa: PLR2004 - records and samples
        raise ValueError(
            f"share= must have several records to share among; got {name} of shape {shape}; give a list of records"
        )
    return int(shape[0])


def _check_shared(share: Sequence[str], call: Mapping[str, Any]) -> None:
    """Check that what is shared is unknown and constant."""
    for name in share:
        value = call[name]
        if value is not None and not (isinstance(value, str) and value in {"auto", "constant"}):
            raise ValueError(
                f"share must name what is unknown and constant in every record; got {name!r}, which is {arguments.shown(value)}; "
                f"let {name} be 'constant', or share something else"
            )


def _each(name: str, value: Any, count: int) -> Sequence[Any]:
    """Return an argument of every record."""
    if value is None or name not in (*_CHANNELS, *_OTHERS):
        return [value] * count
    if name in _CHANNELS:
        several = _records(name, value)
        if several is None and name != "t" and len(_shape(name, value)) > 1:
            several, value = len(value), list(value)
        if several is None and name == "t":
            return [value] * count
    else:
        is_list = isinstance(value, list | tuple) or (name == "lag" and np.ndim(value) == 1)
        several = len(value) if is_list else None
        if several is None or (several != count and name not in _OF_RECORDS):
            return [value] * count
    if several != count:
        raise ValueError(
            f"every channel must have as many records as the others; got {several or 1} of {name} for {count}; give one a record"
        )
    return list(value)


def _merged(results: Sequence[Identification], share: Sequence[str]) -> Shared:
    """Return what all records say of what they share, each weighted by its information."""
    count = len(share)
    information, pull = np.zeros((count, count)), np.zeros(count)
    told, silent = [], []
    for place, result in enumerate(results):
        values = np.array([result.constants[name][0] for name in share])
        covariance = _covariance(result, share)
        there = np.flatnonzero(np.isfinite(values) & (np.diagonal(covariance) > 0))
        if Status(int(result.record_status)) & Status.RANK_DEFICIENT or not there.size:
            silent.append(place)
            continue
        weight = np.zeros((count, count))
        weight[np.ix_(there, there)] = np.linalg.inv(covariance[np.ix_(there, there)])
        information += weight
        pull += weight @ np.nan_to_num(values)
        told.append((np.nan_to_num(values), weight, there.size))
    names = dict.fromkeys(share, float("nan"))
    if not told or (np.diagonal(information) <= 0).any():
        return Shared(names, np.full((count, count), np.nan), float("nan"), 0, float("inf"), tuple(silent))
    together: Array = np.asarray(np.linalg.inv(information), dtype=np.float64)
    merged = together @ pull
    agreement = sum(float((values - merged) @ weight @ (values - merged)) for values, weight, _ in told)
    freedom = sum(size for *_, size in told) - count
    found = dict(zip(share, merged.tolist(), strict=True))
    return Shared(found, together, agreement, freedom, _limit(freedom), tuple(silent))


def _covariance(result: Identification, share: Sequence[str]) -> Array:
    """Return the covariance of constants of one record."""
    errors = np.array([result.constants[name][1] for name in share])
    covariance = np.diag(np.square(errors))
    for i, one in enumerate(share):
        for k, other in enumerate(share[:i]):
            most = _MOST_CORRELATED * errors[i] * errors[k]
            covariance[i, k] = covariance[k, i] = np.clip(covariance_between(result, one, other), -most, most)
    return covariance


def _limit(freedom: int) -> float:
    """Return what a sum of so many squares exceeds in one of a thousand cases (Wilson and Hilferty 1931)."""
    if freedom < 1:
        return float("inf")
    part = 2 / (9 * freedom)
    return float(freedom * (1 - part + _CHANCE * np.sqrt(part)) ** 3)
