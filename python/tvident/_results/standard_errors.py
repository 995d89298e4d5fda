"""Standard errors by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


class StandardErrors(Mapping[str, Array]):
    """Standard errors by name; those that need work are computed when asked for."""

    def __init__(self, known: dict[str, Array], computed: dict[str, Callable[[], Array]]) -> None:
        self._known = known
        self._computed = computed

    def __getitem__(self, name: str) -> Array:
        if name not in self._known and name in self._computed:
            self._known[name] = self._computed[name]()
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys([*self._known, *self._computed]))

    def __len__(self) -> int:
        return len(self._known | self._computed)

    def __repr__(self) -> str:
        return f"<StandardErrors of {', '.join(self)}>"
