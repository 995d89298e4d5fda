"""The options that all calls of ``identify`` have, for those who check types."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict

import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import GivenTerm, Parameter
from tvident._identify.aligned import Align
from tvident._identify.methods import Method
from tvident._identify.robust import LossAsked

if TYPE_CHECKING:
    from tvident._merged import Matrix


class GivenArguments(TypedDict, total=False):
    """Options of :func:`tvident.identify`; what decides of which class the result is stands in its overloads."""

    sample_rate: float | tuple[float, float] | None
    delta: float | tuple[float, float] | None
    t: npt.ArrayLike | tuple[npt.ArrayLike, npt.ArrayLike] | None
    angle_unit: str | None
    torque_unit: str | None
    time_unit: str | None
    method: Method
    terms: Sequence[GivenTerm] | None
    velocity: npt.ArrayLike | None
    acceleration: npt.ArrayLike | None
    instrument: npt.ArrayLike | None
    lag: float | str | Sequence[float | str] | npt.NDArray[Any] | None
    quantisation: float | None
    mask: npt.ArrayLike | Sequence[npt.ArrayLike | None] | None
    weights: npt.ArrayLike | Sequence[npt.ArrayLike | None] | None
    loss: LossAsked | None
    period: float | None
    align: Align
    nan_policy: arguments.RowPolicy
    step: int
    settings: Mapping[str, Any] | None
    workers: int | None
    progress: arguments.Progress


class OfOne(GivenArguments, total=False):
    """Those of one mass."""

    inertia: Parameter | None
    damping: Parameter | None
    stiffness: Parameter | None


Entries: TypeAlias = "Parameter | Matrix | Sequence[Any] | Mapping[Any, Any] | None"


class OfMasses(GivenArguments, total=False):
    """Those of several masses: a parameter may have a kind or a number for every entry or element."""

    inertia: Entries
    damping: Entries
    stiffness: Entries
