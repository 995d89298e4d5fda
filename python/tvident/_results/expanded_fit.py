"""What a fit of expansions found: curves, values and errors at the samples, and where nothing is told."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._expansion import (
    ExpandedRecord,
    ExpandedUnknown,
    Expansion,
    Fitted,
    Linearised,
    Rivals,
    SizeSearch,
    Tried,
    along_record,
    condition_of_curves,
    curve_along,
    curve_length,
    placed,
    reach_over,
)
from tvident._results.curve import ExpandedParameter, of_powers
from tvident._status import Status, untold_samples
from tvident._units import unit_said

Array: TypeAlias = npt.NDArray[np.float64]

_HARDLY_KNOWN = 0.1
"""Error, as a part of what a parameter usually is, from which on nothing is known of it where windows know nothing."""

_FAR_LESS_KNOWN = 10.0
"""Error over what it usually is, from which on nothing is known where it is larger than the parameter usually is, too."""


_DOUBTS = Status.KIND_CONTRADICTED | Status.SCALES_DISAGREE
"""Flags of windows that hold for smooth functions of time, too."""

_OF_CHANNELS = Status.COLOURED | Status.CHANNEL_SUSPECTED
"""Flags that windows found of the channels, whatever the equations."""


@dataclass(frozen=True)
class ExpandedFit:
    """What a fit found.

    Parameters
    ----------
    search : SizeSearch
        After its run.
    expansions : mapping of str to Expansion
    units : mapping of str to str
    unknowns : sequence of ExpandedUnknown
    fitted : Fitted
    around : Linearised
        The rows around what was found.
    unit_of_time : str
        Of what functions of time are functions of: empty for a phase.
    """

    search: SizeSearch
    expansions: Mapping[str, Expansion]
    units: Mapping[str, str]
    unknowns: Sequence[ExpandedUnknown]
    fitted: Fitted
    around: Linearised
    unit_of_time: str = "s"

    @property
    def samples(self) -> int:
        """How many samples the curves have."""
        return curve_length(self.search.records)

    @cached_property
    def usable(self) -> npt.NDArray[np.bool_]:
        """Whether an equation of a record may use a sample, shape (n,)."""
        return self._anywhere((one, np.any(one.usable, axis=0)) for one in self.search.records)

    @property
    def tried(self) -> list[Tried]:
        """All sizes that were tried, the smallest first."""
        return sorted(self.search.tried.values(), key=lambda one: one.parameters)

    @property
    def independent(self) -> float:
        """How many independent equations there were, where what they leave is correlated."""
        return self.fitted.observations / self.search.as_one

    @property
    def ratio(self) -> float:
        """The mean square of the residuals over that of the noise."""
        return self.fitted.ratio

    @cached_property
    def condition(self) -> float:
        """The condition number of the equations, in the better of two bases: the functions as they are, or orthonormal ones."""
        as_they_are = self.fitted.condition
        if not _core.HARDLY_TOLD_APART < as_they_are < np.inf:
            return as_they_are
        return min(as_they_are, condition_of_curves(self.unknowns, self.fitted.root, self.usable))

    def with_errors_of_residuals(self) -> ExpandedFit:
        """Return the same with errors that know of residuals larger than the noise, and of their correlation."""
        if not self.ratio > 1:
            return self
        times, root = self.around.correlation(self.unknowns, self.fitted)
        if not (times > 1 or self.ratio > _core.NOISE_MODEL_FAILS):
            root = self.fitted.root * np.sqrt(self.ratio)
        return replace(self, fitted=replace(self.fitted, root=root))

    def flags(self, windows: Status) -> Status:
        """Return the flags of a record: of those of windows in the place of expansions what they say of channels, and those of the fit."""
        flags = windows & _OF_CHANNELS
        if not np.isfinite(self.condition):
            flags |= Status.RANK_DEFICIENT
        elif self.condition > _core.HARDLY_TOLD_APART:
            flags |= Status.ILL_CONDITIONED
        if self.ratio > _core.NOISE_MODEL_FAILS:
            flags |= Status.NOISE_MODEL
        return flags

    def doubts(self, windows: Status) -> Status:
        """Return what flags of windows say against functions of time in their place: parts of the record, or scales, find other parameters.

        A function of a channel may follow what no window does.
        """
        is_of_time = all(one.is_of_time for one in self.expansions.values())
        return windows & _DOUBTS if is_of_time else Status(0)

    @cached_property
    def curves(self) -> dict[str, ExpandedParameter]:
        """Every expansion as a curve."""
        found = {}
        for one, place in placed(self.unknowns):
            if one.basis is None:
                continue
            expansion = self.expansions[one.name]
            own, root = self.fitted.values[place], self.fitted.root[place]
            covariance = np.asarray(root @ root.T)
            sizes = [each.sizes[one.name] for each in self.tried]
            limits = tuple(each.limits for each in one.basis.coordinates)
            shown = of_powers(own, covariance) if expansion.is_of_powers else (own, covariance)
            found[one.name] = ExpandedParameter(
                name=one.name,
                family=expansion.called,
                coefficients=shown[0],
                covariance=shown[1],
                sizes={
                    "size": np.array([each[0] if len(each) == 1 else each for each in sizes]),
                    "criterion": np.array([each.criterion for each in self.tried]),
                    "residual": np.array([each.residual for each in self.tried]),
                    "parameters": np.array([each.parameters for each in self.tried]),
                    "weight": np.array([each.weight for each in self.tried]),
                },
                limits=limits[0] if len(limits) == 1 else limits,
                unit=self.units.get(one.name, ""),
                unit_of=self.unit_of_time if expansion.is_of_time else unit_said(expansion.of),
                _basis=one.basis,
                _own=own,
                _own_root=root,
                _rivals=self.search.rivals.get(one.name, Rivals()),
            )
        return found

    def values_and_errors(self, step: slice) -> Iterator[tuple[ExpandedUnknown, Array, Array]]:
        """Give every unknown with its values and standard errors at some samples: of a constant one of each."""
        for one, place in placed(self.unknowns):
            own, root = self.fitted.values[place], self.fitted.root[place]
            if one.basis is None:
                yield one, np.asarray(own), np.linalg.norm(root, axis=1)
            else:
                along = curve_along(one.basis, own, root, self.search.rivals.get(one.name, Rivals()))
                yield one, along[0][step], along[1][step]

    def without_untold(
        self, values: dict[str, Array], errors: dict[str, Array], status_of_windows: npt.NDArray[np.uint16], step: slice
    ) -> npt.NDArray[np.uint16]:
        """Return the flags of samples, and make values without an error none.

        Parameters
        ----------
        values, errors : dict of str to ndarray, shape (m,)
            At the samples that are wanted; both are changed.
        status_of_windows : ndarray, shape (n,)
            Of windows in the place of expansions, at every sample.
        step : slice
            The samples that are wanted.
        """
        status = np.where(self.usable[step], np.uint16(0), np.uint16(Status.GAP)).astype(np.uint16)
        for name, expansion in self.expansions.items():
            for channel in expansion.channels:
                values[name] = np.where(np.isfinite(channel[step]), values[name], np.nan)
        for name, value in values.items():
            missing = ~(np.isfinite(value) & np.isfinite(errors[name]))
            values[name], errors[name] = np.where(missing, np.nan, value), np.where(missing, np.nan, errors[name])
            status[missing] |= np.uint16(Status.INVALID)
        status[self._untold(values, errors, status_of_windows, step)] |= np.uint16(Status.ILL_CONDITIONED)
        return status

    def _untold(
        self,
        values: Mapping[str, Array],
        errors: Mapping[str, Array],
        status_of_windows: npt.NDArray[np.uint16],
        step: slice,
    ) -> npt.NDArray[np.bool_]:
        """Return where the motion tells nothing of what is expanded, and no function reaches over it.

        Windows in its place know nothing there, or what it multiplies is noise. That noise would make errors small, and an inertia zero:
        errors are at least those that the motion elsewhere leaves.
        """
        of_windows = untold_samples(status_of_windows[step])
        found: npt.NDArray[np.bool_] = np.zeros(of_windows.shape, np.bool_)
        for one in self.unknowns:
            if one.basis is None:
                continue
            moves, reach = np.ones(found.shape, np.bool_), np.ones(found.shape)
            if all(role != "term" for _, role, _, _ in one.entries):
                moving = self._moving(one)
                if not moving.all():
                    moves, reach = moving[step], reach_over(one.basis, moving & self.usable)[step]
            dark = of_windows | ~moves
            value, error = values[one.name], errors[one.name]
            known = ~dark & np.isfinite(value)
            if known.any():
                usual, known_to = np.median(np.abs(value[known])), np.median(error[known])
                least = np.where(moves, error, np.maximum(error, known_to * reach))
                found |= least > np.where(dark, _HARDLY_KNOWN * usual, max(usual, _FAR_LESS_KNOWN * known_to))
        return found

    def _moving(self, one: ExpandedUnknown) -> npt.NDArray[np.bool_]:
        """Return at which samples what an unknown multiplies moves in one of the records, shape (n,)."""
        return self._anywhere(
            (record, record.moves(one.entries, self.search.noise[0])) for record in self.search.records
        )

    def _anywhere(self, each: Iterable[tuple[ExpandedRecord, npt.NDArray[np.bool_]]]) -> npt.NDArray[np.bool_]:
        """Return at which samples of the curves something holds in one of the records."""
        found = np.zeros(self.samples, np.bool_)
        for record, holds in each:
            if record.alignment is None:
                found[: record.samples] |= holds
            else:
                found[record.alignment.nearest[holds & record.alignment.is_inside]] = True
        return found

    def covariances(self, names: Sequence[str]) -> dict[tuple[str, str], Array]:
        """Return covariances of pairs of some unknowns at every sample, shape (n,)."""
        wanted = [(one, place) for one, place in placed(self.unknowns) if one.name in names]
        found = {}
        for (one, rows), (other, columns) in combinations(wanted, 2):
            block = self.fitted.root[rows] @ self.fitted.root[columns].T
            total = np.zeros(self.samples)
            for number, row in enumerate(block):
                before = 1.0 if one.basis is None else along_record(one.basis, np.eye(len(block))[number])
                after = float(row[0]) if other.basis is None else along_record(other.basis, row)
                total += before * after
            found[one.name, other.name] = total
        return found
