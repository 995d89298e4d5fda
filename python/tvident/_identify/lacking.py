"""Terms that the equation seems to lack in strong form, where something is constant: what windows do not follow is left over."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import with_error
from tvident._equation import BUILT_IN, COEFFICIENTS, Unknown
from tvident._identify.blocks import ROUNDING, products, solved, without
from tvident._identify.columns import Columns
from tvident._identify.data import Data, cut
from tvident._identify.methods import StrongForm
from tvident._identify.settings import Request
from tvident._units import ROTARY

Array = npt.NDArray[np.float64]

_MOST = 1 << 14
"""Samples that are looked at, in the middle of a record."""

_EXPLAINED = 0.8
"""And where it leaves at most this part of what is left without it: what biased derivatives leave any term explains a little."""

_AS_GOOD = 1.05
"""A pendulum is named before a spring that softens where it leaves at most so many times as much."""

_NO_SPRING = 0.1
"""Beside gravity there is no other spring worth a word where its stiffness is less than this part of it."""


@dataclass(frozen=True)
class Lacking:
    """A term that a record lacks.

    Parameters
    ----------
    name : str
    value, error : float
        Its factor and the standard error of that.
    alone : bool
        Whether it takes the place of the stiffness.
    """

    name: str
    value: float
    error: float
    alone: bool

    def words(self, terms: Sequence[str], unit: str) -> str:
        """Return what to do."""
        amount = f"{with_error(self.value, self.error)} {unit}"
        place = ", stiffness=0" if self.alone else ""
        return f"{BUILT_IN[self.name].suspected(self.value, amount)}: give terms={[*terms, self.name]}{place}"


def lacking_terms(
    data: Data,
    request: Request,
    unknowns: Sequence[Unknown],
    found: Sequence[_core.Identification],
    plan: Callable[[], _core.LocalPolynomials],
    known: Mapping[str, Any],
) -> list[Lacking | None]:
    """Return the term that every record lacks, if any.

    Parameters
    ----------
    data : Data
    request : Request
    unknowns : sequence of Unknown
        Parameters, then terms.
    found : sequence of _core.Identification
        Which unknowns are constant there is tested.
    plan : callable
        Makes the polynomials.
    known : mapping of str to float or ndarray
        Parameters that are known.
    """
    kinds = [one.kind for one in found[0].unknowns] if found else []
    constant = [place for place, kind in enumerate(kinds) if kind == "constant"]
    nothing: list[Lacking | None] = [None] * data.records
    is_plain = isinstance(request.form, StrongForm) and data.instruments is None and not request.lag
    if not (is_plain and constant) or data.motion.recorded or any(one.inner for one in unknowns):
        return nothing
    middle = max(0, data.time.size - _MOST) // 2
    some = slice(middle, middle + _MOST)
    terms = [one for one in unknowns if one.name not in COEFFICIENTS]
    made, length = plan(), found[0].window_length
    derivatives = made.estimate(data.angles[..., some], workers=data.workers).derivatives
    columns = dict(zip(("stiffness", "damping", "inertia"), derivatives, strict=True))
    evaluated = Columns(terms, data.angles[..., some], data.time[some], data.period, plan, weak=False).all_samples({})
    rhs = data.torques[..., some].astype(np.float64)
    for name, value in known.items():
        rhs = rhs - cut(value, some) * columns[name]
    names = [name for name, term in BUILT_IN.items() if term.is_sought and name not in evaluated]
    if not any(one.name == "stiffness" for one in unknowns):
        names = [name for name in names if BUILT_IN[name].spring != "beside"]
    if data.axis.system is not ROTARY:
        names = [name for name in names if not BUILT_IN[name].angle_period]
    angle, velocity = columns["stiffness"], columns["damping"]
    candidates = {name: BUILT_IN[name].function(np, angle, velocity) for name in names}
    every = [{**columns, **evaluated}[one.name] for one in unknowns] + [candidates[name] for name in names] + [rhs]
    rows = np.stack([np.broadcast_to(one, rhs.shape) for one in every], axis=-1)
    inside = slice(length // 2, rows.shape[-2] - length // 2)
    rows = rows[..., inside, :].reshape(data.records, -1, len(every))
    usable = np.isfinite(rows).all(axis=-1)
    if data.mask is not None:
        usable &= data.mask[..., some][..., inside].reshape(usable.shape)
    weights = (
        usable if data.weights is None else usable * data.weights.values[..., some][..., inside].reshape(usable.shape)
    )
    rows = np.where(usable[..., np.newaxis], rows, 0.0) * np.sqrt(weights)[..., np.newaxis]
    squares = products(rows, max(length, found[0].regression_window))
    if squares is None:
        return nothing
    windowed = [place for place, kind in enumerate(kinds) if kind != "constant"]
    spring = next((place for place, one in enumerate(unknowns) if one.name == "stiffness"), None)
    return [_Test(one[0], one[1], windowed, constant, names, spring).result() for one in zip(*squares, strict=True)]


@dataclass(frozen=True)
class _Test:
    """Equations of one record, as products of their columns in blocks: unknowns, candidates, torque."""

    products: Array
    norms: Array
    windowed: list[int]
    constant: list[int]
    names: list[str]
    spring: int | None

    def result(self) -> Lacking | None:
        """Return the term that explains most of what is left, if it explains enough."""
        left = without(self.products, self.windowed)
        if not np.isfinite(left).all():
            # A candidate, such as the cube of a large angle, is beyond doubles.
            return None
        total, rhs = left.sum(axis=0), left.shape[-1] - 1
        base, _ = solved(total, self.constant)
        if not base > ROUNDING * total[rhs, rhs]:
            return None
        tried: dict[str, tuple[float, Lacking]] = {}
        for number, name in enumerate(self.names):
            place = len(self.windowed) + len(self.constant) + number
            rest, values = solved(total, [*self.constant, place])
            own = np.zeros(rhs + 1)
            own[self.constant], own[place] = -solved(total, self.constant, place)[1], 1.0
            errors = np.zeros(rhs + 1)
            errors[[*self.constant, place]], errors[rhs] = -values, 1.0
            scores, square = np.einsum("i,bij,j->b", own, left, errors), own @ total @ own
            if not square > ROUNDING:
                continue
            unit = self.norms[rhs] / self.norms[place]
            error = float(np.sqrt(np.sum(scores**2))) / square
            value = float(values[-1])
            spring = (
                values[self.constant.index(self.spring)] / self.norms[self.spring]
                if self.spring in self.constant
                else np.inf
            )
            term = BUILT_IN[name]
            alone = term.spring == "instead" and bool(abs(spring) < _NO_SPRING * abs(value) / self.norms[place])
            is_there = abs(value) > _core.CONSPICUOUS * error and (term.spring == "beside" or value > 0)
            if is_there and rest <= _EXPLAINED * base:
                tried[name] = (rest, Lacking(name, value * unit, error * unit, alone))
        if not tried:
            return None
        best = min(tried, key=lambda name: tried[name][0])
        if BUILT_IN[best].spring == "beside":
            instead = [name for name in tried if BUILT_IN[name].spring == "instead"]
            best = next((name for name in instead if tried[name][0] <= _AS_GOOD * tried[best][0]), best)
        return tried[best][1]
