"""What a result keeps of the comparison with its recording when it is stored without it: its summary says the same later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from tvident._results.held_back import HeldBack
from tvident._results.verdict import RECORDS, ExplainedTorque, explained_of


def plain_comparison(result: Any) -> dict[str, Any]:
    """Return how much of a recording a result explains, as JSON has it."""
    held_back = {name: _plain(value) for name, value in asdict(result.held_back()).items()}
    each = [None if one is None else [one.share, one.is_rest_noise] for one in comparisons(result)]
    # A part of a record is what the whole is, which is not there later.
    return {"held_back": held_back, "explained": each, "distrusted": list(result._distrusted)}  # noqa: SLF001 - of this room


def comparisons(result: Any) -> list[ExplainedTorque | None]:
    """Return how much of the torque of every record is explained; None of those beyond the first hundred, at which no verdict looks."""
    if result.inertia.ndim == 1:
        return [result._explained_before or explained_of(result)]  # noqa: SLF001 - of this room
    places = list(np.ndindex(result.inertia.shape[:-1]))
    known = result._explained_each or [None] * len(places)  # noqa: SLF001 - of this room
    return [
        explained_of(result[place if len(place) > 1 else place[0]]) if one is None and index < RECORDS else one
        for index, (place, one) in enumerate(zip(places, known, strict=True))
    ]


def held_back_from(plain: Mapping[str, Any] | None) -> HeldBack | None:
    """Return what a file says of parts that were held back; None where it was written before it did."""
    if plain is None:
        return None
    told: dict[str, Any] = {
        name: np.asarray(value) if isinstance(value, list) else value for name, value in plain["held_back"].items()
    }
    return HeldBack(**told)


def explained_from(plain: Mapping[str, Any] | None) -> Sequence[ExplainedTorque | None] | None:
    """Return how much of the torque of every record a file says to be explained."""
    if plain is None:
        return None
    return [None if one is None else ExplainedTorque(one[0], one[1]) for one in plain["explained"]]


def distrusted_from(plain: Mapping[str, Any] | None) -> tuple[str | None, ...] | None:
    """Return why a file says that no sample of each record is to be trusted; None where it was written before it did."""
    return None if plain is None or "distrusted" not in plain else tuple(plain["distrusted"])


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
