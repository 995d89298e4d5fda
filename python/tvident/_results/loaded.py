"""Results of identifications from files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._results.kept import distrusted_from, explained_from, held_back_from
from tvident._results.records import IdentifiedRecords, Shared
from tvident._results.result import Identification
from tvident._results.stored import restored, words_from


def from_file(place: str, arrays: dict[str, npt.NDArray[Any]], facts: Mapping[str, Any]) -> Identification:
    """Return the result that a file holds.

    Parameters
    ----------
    place : str
        What the file is called.
    arrays : dict of str to ndarray
    facts : mapping
    """
    found = restored(place, arrays, facts)
    several = found.status.ndim > 1
    result = Identification(
        found,
        time=arrays["time"],
        terms=list(facts["terms"]),
        jumps=tuple(tuple(one) for one in facts["jumps"]) if several else tuple(facts["jumps"]),
        words=words_from(facts["words"]),
        settings=facts["settings"],
    )
    # Files of before have none.
    result._held_back = held_back_from(facts.get("compared"))  # noqa: SLF001 - of this room
    result._explained_each = explained_from(facts.get("compared"))  # noqa: SLF001 - likewise
    reasons = distrusted_from(facts.get("compared"))
    if reasons is not None:
        result._distrusted = reasons  # noqa: SLF001 - likewise
    return result


def list_from_file(place: str, arrays: Mapping[str, npt.NDArray[Any]], facts: Mapping[str, Any]) -> IdentifiedRecords:
    """Return the list of results that a file holds, with what they share."""
    own: list[dict[str, npt.NDArray[Any]]] = [{} for _ in facts["records"]]
    for name, values in arrays.items():
        number, _, rest = name.partition("/")
        own[int(number)][rest] = values
    found = [from_file(place, columns, one) for columns, one in zip(own, facts["records"], strict=True)]
    told = facts["shared"]
    if told is None:
        return IdentifiedRecords(found)
    shared = {**told, "covariance": np.array(told["covariance"]), "silent": tuple(told["silent"])}
    return IdentifiedRecords(found, Shared(**shared))
