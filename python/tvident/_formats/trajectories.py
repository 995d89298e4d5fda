"""Results of Modelica: trajectories that Dymola and OpenModelica write as matrices of MATLAB, with names and units of their own."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import zip_longest
from typing import Any

import numpy as np

_PARTS = {"Aclass", "name", "dataInfo", "data_2"}
_CLASS = "Atrajectory"

_UNIT = re.compile(r"\[([^\[\]|]+)(?:\|[^\[\]]*)?\]")
"""The unit of what is written, and behind it that of what is shown: ``[rad|deg]``."""


def is_of_modelica(variables: Mapping[str, Any]) -> bool:
    """Return whether variables are those of a result of Modelica."""
    if not set(variables) >= _PARTS:
        return False
    words = [str(one).strip(" \0") for one in np.ravel(variables["Aclass"])]
    return bool(words) and words[0] == _CLASS


def trajectories(variables: Mapping[str, Any], skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the trajectories of all variables, with the units of their descriptions; what is constant is a number."""
    kind = str(np.ravel(variables["Aclass"])[-1]).strip(" \0")
    is_transposed = kind == "binTrans"
    names, words = (_texts(variables.get(one, ()), is_transposed=is_transposed) for one in ("name", "description"))
    about = np.atleast_2d(variables["dataInfo"]).astype(int)
    about = about.T if is_transposed else about
    tables = {
        number: np.atleast_2d(variables[key]).T if is_transposed else np.atleast_2d(variables[key])
        for number, key in ((1, "data_1"), (2, "data_2"))
        if key in variables
    }
    if len(names) != len(about):
        raise ValueError(
            f"a result of Modelica must say where each variable is; it names {len(names)}, and tells of {len(about)}"
        )
    constants = 0
    for place, (name, (table, column, *_)) in enumerate(zip(names, about.tolist(), strict=True)):
        found = tables.get(table or 2)
        if found is None or not 0 < abs(column) <= found.shape[1]:
            skipped.append(f"{name[:40]} (no column {column} of table {table})")
            continue
        if table == 1:
            constants += 1
            continue
        said = _UNIT.search(words[place]) if place < len(words) else None
        # The first is the time, in the unit that its description says, of the column that it stands in.
        samples = found[:, abs(column) - 1] * (-1.0 if column < 0 else 1.0)
        yield (f"{name} [{said[1]}]" if said else name), samples
    if constants:
        skipped.append(f"{constants} constant variables of data_1")


def _texts(lines: Any, *, is_transposed: bool) -> list[str]:
    """Return texts that stand in rows, or letter by letter in columns."""
    rows = [str(one) for one in np.ravel(lines)]
    if is_transposed:
        rows = ["".join(letters) for letters in zip_longest(*rows, fillvalue=" ")]
    return [row.replace("\0", " ").strip() for row in rows]
