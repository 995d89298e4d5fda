"""Results of lists of records in one file, from which they come back as they were."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy.typing as npt

from tvident._files import write_result
from tvident._results.result import Identification
from tvident._results.stored import plain_result

KIND_OF_LISTS = "records"


def store_list(path: Path, records: Sequence[Identification], shared: Mapping[str, Any] | None) -> None:
    """Write all results of a list, the arrays of each behind its number, and what they share."""
    arrays: dict[str, npt.NDArray[Any]] = {}
    units: dict[str, str] = {}
    each = []
    for place, one in enumerate(records):
        own, facts = plain_result(one._table(), one._found, one._rest())  # noqa: SLF001 - of this room
        arrays |= {f"{place}/{name}": values for name, values in own.items()}
        units |= {f"{place}/{name}": unit for name, unit in one.units.items()}
        each.append(facts)
    write_result(path, arrays, units, json.dumps({"kind": KIND_OF_LISTS, "records": each, "shared": shared}))
