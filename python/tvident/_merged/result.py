"""The result of an identification of what trials or masses share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._merged.determined import undetermined
from tvident._merged.earlier import stored
from tvident._merged.elements import matrix_of
from tvident._merged.expanded import FoundExpanded
from tvident._merged.held_back import HeldBackTorque
from tvident._merged.heterogeneity import differences_of, excess
from tvident._merged.merging import Identifiable, LackingTerms, Merging, Part
from tvident._merged.oscillating import Oscillating
from tvident._merged.reported import Reported
from tvident._merged.short import as_html, in_one_line
from tvident._merged.verdict import wrong_inertia
from tvident._merged.words import whose
from tvident._results import ExpandedParameter, samples_between, scan_of
from tvident._status import Status

Array: TypeAlias = npt.NDArray[np.float64]

UNEXPLAINED_SPREAD = Status.KIND_CONTRADICTED

OTHER_BY, OTHER, SOMEWHERE = 2.0, 0.02, 0.1
"""Elements are others beside a term where they move by so many errors and by this part of themselves, at this part of the samples."""


class MergedIdentification(Oscillating, Reported):
    r"""What :func:`tvident.identify` found of what repeated trials or coupled masses share. ``n`` is the number of samples.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds; with a phase, those of the median trial.
    phase : ndarray, shape (n,), or None
        The phase of every sample, from 0 to 1, where trials were aligned on one.
    inertia, damping, stiffness : ndarray, shape (n,) for trials, (masses, masses, n) for masses
        Identified or known values, as matrices for masses. NaN where something that an entry is made of cannot be known.
    elements : dict of str to ndarray, shape (n,)
        Values of every element by name: for trials ``"inertia"``, ``"damping"``, ``"stiffness"`` and terms; for matrices
        ``"stiffness_0_1"`` and so on; for a :class:`Chain` those of springs, dampers and masses.
    terms : dict of str to ndarray, shape (n,)
        The elements that are factors of terms.
    constants : dict of str to (value, stderr)
        Elements that are constant.
    kinds : dict of str to str
        ``"constant"``, ``"windowed"``, ``"expanded"`` or ``"known"``, by element.
    expansions : dict of str to ExpandedParameter
        Elements that are sums of functions, by name: as curves of what they are functions of.
    stderr : dict of str to ndarray
        Standard errors of all elements and of ``"inertia"``, ``"damping"`` and ``"stiffness"``, in their shapes. Where trials differ by
        more than their errors explain, those of the elements that do are larger by as much.
    trial_spread : dict of str to (ndarray, ndarray), each of shape (trials,)
        By how much every element of each trial alone differs from that of all, and the standard error of that; empty with one trial.
    identifiable : dict of str to Identifiable
        Whether every element can be known, with ``.reason``; what cannot is NaN.
    status : ndarray of uint16, shape (n,)
        Flags of :class:`tvident.Status` that hold at this sample.
    record_status : Status
        Flags that hold for the whole record.
    residual_std : ndarray, shape (n,)
        Standard deviation of what is left of the equations, over that of their noise.
    settings : dict
        What was chosen, as plain JSON.
    scans : tuple of Scan
        Estimates by the width of the test function; see :meth:`scan`.
    units : dict of str to str

    See Also
    --------
    identify : returns it, with ``ensemble_axis=`` or ``dof_axis=``.
    Chain : a structure of masses.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion. The
    perspectives of few degrees of freedom and of ensembles.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> rigs = [tvident.simulate_torsional_rig(duration=2.0, seed=seed) for seed in range(4)]
    >>> angle, torque = (np.stack([getattr(rig, name) for rig in rigs]) for name in ("angle", "torque"))
    >>> result = tvident.identify(angle, torque, sample_rate=1000, ensemble_axis=0)
    >>> bool(np.nanmedian(np.abs(result.stiffness / rigs[0].stiffness - 1)) < 0.02)
    True
    """

    def __init__(self, merging: Merging) -> None:
        self._merging = merging
        wanted = slice(None, None, merging.step)
        self.time: Array = merging.sampling.times(merging.samples)[wanted]
        self.phase = None if merging.phase is None else merging.phase[wanted]
        size = self.time.size
        self.elements: dict[str, Array] = {}
        self.kinds: dict[str, str] = {}
        self.constants: dict[str, tuple[float, float]] = {}
        self.stderr: dict[str, Array] = {}
        self.trial_spread: dict[str, tuple[Array, Array]] = {}
        self._scatter: dict[str, float] = {}
        self.tests: dict[str, float] = {}
        self.jumps: tuple[float, ...] = ()
        self.expansions: dict[str, ExpandedParameter] = {}
        for element in merging.elements:
            value = element.number
            self.elements[element.name] = np.full(size, value)
            self.stderr[element.name] = np.full(size, np.nan if np.isnan(value) else 0.0)
            self.kinds[element.name] = "known" if element.is_known else "constant"
        self.status = np.zeros(size, np.uint16)
        flags = int(Status.CHANNEL_SUSPECTED) if merging.sampling.doubt else 0
        residuals = []
        for part in merging.parts:
            self._take(part, size)
            self.status |= part.found.status
            flags |= part.found.record_status
            residuals.append(part.found.residual)
        squares = [np.square(one) for one in residuals] or [np.full(size, np.nan)]
        self.residual_std: Array = np.sqrt(np.mean(squares, axis=0)).astype(np.float64)
        self.jumps = tuple(
            sorted(
                {
                    merging.sampling.start + one * merging.sampling.period
                    for part in merging.parts
                    for one in part.found.jumps
                }
            )
        )
        if any(factor > 1 for factor in self._scatter.values()):
            flags |= int(UNEXPLAINED_SPREAD)
        self.identifiable = self._identifiable()
        for name, verdict in self.identifiable.items():
            if not verdict:
                self.elements[name], self.stderr[name] = np.full(size, np.nan), np.full(size, np.nan)
                self.kinds[name] = "unknown"
                self.constants.pop(name, None)
                flags |= int(Status.RANK_DEFICIENT) if merging.unknowable.get(name) is None else 0
        if "unknown" in self.kinds.values() and set(self.kinds.values()) <= {"known", "unknown"}:
            self.status |= np.uint16(Status.INVALID | Status.RANK_DEFICIENT)
            flags |= int(Status.RANK_DEFICIENT)
        self.record_status = Status(flags)
        if merging.lacking is not None:
            self._hold(merging.lacking)
        self.settings = self._settings()
        self.scans = tuple(scan_of(part.found.scan, part.names) for part in merging.parts if part.found.scan.tried)
        self.derive()
        if wrong_inertia(self, merging):
            # No machine has that: something else was told from it badly.
            self.record_status |= Status.ILL_CONDITIONED

    def _hold(self, lacking: LackingTerms) -> None:
        """Make errors hold what missing terms change, and trust nothing that they move."""
        self.record_status |= Status.TERM_SUSPECTED
        for name, change in lacking.changes.items():
            if self.kinds[name] in {"known", "unknown"}:
                continue
            values, errors = self.elements[name], self.stderr[name]
            there = np.isfinite(values) & np.isfinite(errors)
            is_other = (change > OTHER_BY * errors) & (change > OTHER * np.abs(values)) & there
            if there.any() and np.mean(is_other[there]) > SOMEWHERE:
                self.status |= np.uint16(Status.NOISE_MODEL)
            self.stderr[name] = np.hypot(errors, change)
            if name in self.constants:
                self.constants[name] = (self.constants[name][0], float(np.median(self.stderr[name])))

    @classmethod
    def of_known(cls, merging: Merging, known: Mapping[str, Any]) -> MergedIdentification:
        """Return a result that was found before: what it is made of, without its recording, and attributes.

        See Also
        --------
        tvident.load : reads results from files.
        """
        found = cls.__new__(cls)
        found.__dict__.update({"_merging": merging, **known})
        found.derive()
        return found

    def between(self, begin: float | None = None, end: float | None = None) -> MergedIdentification:
        """Return the part of the result from one time to another.

        Parameters
        ----------
        begin, end : float, optional
            Seconds, as in ``time``; both belong to the part. By default the first and the last.

        Returns
        -------
        MergedIdentification
            Views, no copies. Constants, settings, words and flags of the record are those of the whole; of the recording nothing is kept.

        Raises
        ------
        ValueError
            If nothing lies in between.

        See Also
        --------
        FileRecording.select : the same of a recording.
        Identification.between : of one record.
        """
        samples, first, last = samples_between(self.time, begin, end)
        merging, time = self._merging, self.time[samples]
        count = (time.size - 1) * merging.step + 1
        part = replace(
            merging,
            parts=(),
            sampling=replace(merging.sampling.of_result, start=float(time[0])),
            samples=count,
            phase=None if self.phase is None else self.phase[samples],
            inertia={name: self._wanted(pattern)[:, :, samples] for name, pattern in merging.inertia.items()},
            recorded=None,
            is_part=True,
        )
        whole = (
            "kinds",
            "constants",
            "expansions",
            "tests",
            "trial_spread",
            "identifiable",
            "settings",
            "scans",
            "record_status",
        )
        along = ("residual_std", "status")
        known: dict[str, Any] = {name: getattr(self, name) for name in (*whole, "_told")}
        known |= {name: getattr(self, name)[samples] for name in along}
        return MergedIdentification.of_known(
            part,
            {
                **known,
                "time": time,
                "phase": part.phase,
                "elements": {name: values[samples] for name, values in self.elements.items()},
                "stderr": {name: self.stderr[name][samples] for name in self.elements},
                "jumps": tuple(jump for jump in self.jumps if first <= jump <= last),
                "_covariances": {pair: values[samples] for pair, values in self._covariances.items()},
                "_held_back": HeldBackTorque(why_not="this is a part of a result; ask the whole"),
                "_distrusted": self._distrusted,
            },
        )

    def __getstate__(self) -> dict[str, Any]:
        # A record may be long, and functions cannot be stored; what was found of it stays.
        sampling = self._merging.sampling.of_result
        compared = {"_held_back": self._held_back, "_share": self._share, "_distrusted": self._distrusted}
        known = {"_covariances": self._covariances, "_told": self._told, **compared}
        return {
            **self.__dict__,
            **known,
            "_merging": replace(self._merging, parts=(), sampling=sampling, recorded=None),
        }

    def derive(self) -> None:
        """Find what follows from the elements; called once.

        See Also
        --------
        elements, stderr : what it follows from.
        """
        merging = self._merging
        self.terms: dict[str, Array] = {
            one.name: self.elements[one.name] for one in merging.elements if one.of not in COEFFICIENTS
        }
        self.inertia, self.damping, self.stiffness = (self._coefficient(of) for of in range(3))
        for coefficient, name in enumerate(COEFFICIENTS):
            self.stderr[name] = self._error(coefficient)
        self.units = dict(merging.units)

    def _take(self, part: Part, size: int) -> None:
        """Take what was found of some elements."""
        if isinstance(part.found, FoundExpanded):
            self.expansions |= part.found.curves
        for one in part.found.elements:
            name = part.names[one.element]
            scatter = 1.0
            if one.spread:
                self.trial_spread[name] = differences_of(one.spread)
                scatter = excess(*self.trial_spread[name])
            self._scatter[name] = scatter
            self.kinds[name] = one.kind
            if one.test is not None:
                self.tests[name] = one.test.probability
            if one.kind == "constant":
                self.constants[name] = (float(one.values[0]), float(one.stderr[0] * scatter**0.5))
            values, error = np.broadcast_to(one.values, size), np.broadcast_to(one.stderr * scatter**0.5, size)
            self.elements[name] = values.copy()
            self.stderr[name] = np.where(np.isnan(values), np.nan, error)

    def _identifiable(self) -> dict[str, Identifiable]:
        """Return what can be known: of what was asked beforehand, and of what the equations determined."""
        merging, found = self._merging, {}
        lost = {name for part in merging.parts for name in part.names if np.isinf(part.found.condition)}
        noisy: dict[str, str] = {}
        for part in merging.parts:
            noisy |= undetermined(part, merging.sampling.period)
        for element in merging.elements:
            name = element.name
            if name in merging.unknowable:
                found[name] = Identifiable(identifiable=False, reason=merging.unknowable[name])
            elif element.is_known:
                found[name] = Identifiable(identifiable=True, reason="it is known")
            elif name in lost:
                found[name] = Identifiable(
                    identifiable=False,
                    reason="the equations do not determine it: its regressors are a combination of others",
                )
            elif name in noisy:
                found[name] = Identifiable(identifiable=False, reason=noisy[name])
            else:
                found[name] = Identifiable(identifiable=True, reason=self._why(name))
        return found

    def _why(self, name: str) -> str:
        for part in self._merging.parts:
            if name in part.names and part.found.record_status & Status.ILL_CONDITIONED:
                return "the equations hardly determine it: the motion tells regressors apart by little more than noise"
        return "the equations determine it"

    @cached_property
    def _covariances(self) -> dict[tuple[str, str], Array]:
        """Covariances of all pairs of elements that one call of the core found, themselves included."""
        known: dict[tuple[str, str], Array] = {}
        for part in self._merging.parts:
            found = part.found
            names = [part.names[place] for place in found.constants]
            both = np.array(found.covariance).reshape(len(names), len(names))
            for i, one in enumerate(names):
                for j, other in enumerate(names[: i + 1]):
                    known[one, other] = np.asarray(both[i, j])
            for (one_place, other_place), values in found.covariances.items():
                known[part.names[one_place], part.names[other_place]] = np.asarray(values)
        larger = {name: factor**0.5 for name, factor in self._scatter.items()}
        known = {
            pair: np.broadcast_to(values * (larger.get(pair[0], 1.0) * larger.get(pair[1], 1.0)), self.time.shape)
            for pair, values in known.items()
        }
        for name in self.elements:
            known[name, name] = self.stderr[name] ** 2
        return known

    def _patterns(self, coefficient: int) -> dict[str, Array]:
        """Return by how much elements enter a matrix, shape (masses, masses, 1), or (masses, masses, n) where masses move that."""
        merging = self._merging
        fixed = matrix_of(merging.elements, coefficient, max(merging.masses, 1))
        moving = merging.inertia if coefficient == 0 else {}
        return {name: pattern[:, :, np.newaxis] for name, pattern in fixed.items()} | {
            name: self._wanted(pattern) for name, pattern in moving.items()
        }

    def _wanted(self, pattern: Array) -> Array:
        """Return a matrix at the samples that are wanted: what comes from a file, or is a part, has no others."""
        return pattern if pattern.shape[2] == self.time.size else pattern[:, :, :: self._merging.step]

    def _coefficient(self, coefficient: int) -> Array:
        """Return inertia, damping or stiffness: an array, or matrices made of the elements."""
        if not self._merging.masses:
            return self.elements[COEFFICIENTS[coefficient]]
        masses = self._merging.masses
        total = np.zeros((masses, masses, self.time.size))
        for name, pattern in self._patterns(coefficient).items():
            rows, columns = np.nonzero(pattern.any(axis=2))
            total[rows, columns] += pattern[rows, columns] * self.elements[name]
        return total

    def _error(self, coefficient: int) -> Array:
        """Return the standard errors of inertia, damping or stiffness."""
        if not self._merging.masses:
            return self.stderr[COEFFICIENTS[coefficient]]
        patterns, covariances = self._patterns(coefficient), self._covariances
        variance = np.zeros((self._merging.masses, self._merging.masses, self.time.size))
        for (one, other), values in covariances.items():
            if one in patterns and other in patterns:
                both = patterns[one] * patterns[other] * (1.0 if one == other else 2.0)
                rows, columns = np.nonzero(both.any(axis=2))
                variance[rows, columns] += both[rows, columns] * values
        return np.sqrt(np.maximum(variance, 0))

    def _settings(self) -> dict[str, Any]:
        """Return what was chosen, as plain JSON."""
        merging = self._merging
        of = [part.found for part in merging.parts]
        return {
            "form": "weak",
            "sample_rate": 1 / merging.sampling.period,
            "trials": merging.trials,
            "masses": merging.masses or 1,
            **stored(merging, self.kinds),
            "window_length": [one.window_length for one in of],
            "exponent": [one.exponent for one in of],
            "regression_window": [one.regression_window for one in of],
            "noise": [list(map(list, one.noise)) for one in of],
            "prediction_error": [one.prediction_error for one in of],
            "step": merging.step,
            **({"expansions": sizes} if (sizes := self._sizes()) else {}),
            **merging.sampling.settings,
        }

    def _sizes(self) -> dict[str, Any]:
        """Return which functions were taken, as plain JSON."""
        return {
            name: {"family": one.family, "size": one.size, "limits": one.limits}
            for name, one in self.expansions.items()
        }

    def __repr__(self) -> str:
        return in_one_line(self, whose(self._merging.trials, max(self._merging.masses, 1)))

    def _repr_html_(self) -> str:
        return as_html(self, whose(self._merging.trials, max(self._merging.masses, 1)))


def parts_of_result(found: MergedIdentification) -> Sequence[Part]:
    """Return what every call of the core found."""
    return found._merging.parts  # noqa: SLF001 - of this file


def that_lacks(found: MergedIdentification, what: LackingTerms) -> MergedIdentification:
    """Return a result that says what it lacks, and whose errors hold what that changes."""
    return MergedIdentification(replace(found._merging, lacking=what))  # noqa: SLF001 - of this file
