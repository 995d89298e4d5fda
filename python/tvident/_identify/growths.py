"""Terms by which damping and stiffness grow along a record beside their constants, to ask whether they are constant."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._equation import Term


def _growth(name: str, degree: int) -> Term:
    """Return the term by which damping or stiffness grows with a power of time beside its constant."""

    def function(t: npt.NDArray[Any], angle: npt.NDArray[Any], velocity: npt.NDArray[Any]) -> npt.NDArray[Any]:
        middle, half = (t[0] + t[-1]) / 2, (t[-1] - t[0]) / 2
        moves = velocity if name == "damping" else angle
        return np.asarray(((t - middle) / half) ** degree * moves)

    return Term(f"{name} growing {degree}", function)


GROWTHS = {name: [_growth(name, degree) for degree in (1, 2, 3)] for name in ("damping", "stiffness")}
"""Terms by which a coefficient follows a cubic in time."""
