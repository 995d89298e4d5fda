"""Does it hold? The simulation of what trials or masses share, in comparison with recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._merged.merging import Identifiable, Merging
from tvident._merged.models import Responding, model_of
from tvident._merged.recorded import MergedRecorded
from tvident._results import (
    accounted_for,
    begins_once,
    both_or_none,
    every_sample,
    in_units_of,
    still_there,
    without_gaps,
)
from tvident._status import stretches_of

Array: TypeAlias = npt.NDArray[np.float64]

_BRIDGED = 3
"""Samples of a torque that may be missing: a straight line stands for them, as for one mass."""


class MergedSimulated:
    """The part of a result of trials or masses that is compared with recordings.

    Attributes
    ----------
    elements, kinds, identifiable, units :
        Those of the result.
    """

    elements: dict[str, Array]
    kinds: dict[str, str]
    identifiable: dict[str, Identifiable]
    units: Mapping[str, str]
    _merging: Merging

    def simulate(
        self,
        torque: npt.ArrayLike | Sequence[npt.ArrayLike],
        initial: npt.ArrayLike | None = None,
        *,
        angle: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
        phase: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
        base: npt.ArrayLike | None = None,
    ) -> Any:
        """Return the angles with which the identified system responds to torques.

        Between two samples elements are the mean of theirs there, torques and a base that moves follow straight lines, for which the
        response of linear equations is exact. Other equations are integrated in steps that become smaller until halves of them change
        the response by less than a part of 1e-5; a mass with dry friction sticks and breaks away. What cannot be trusted in between is
        bridged by straight lines. Costs about 10 µs a sample where equations are linear, 0.2 ms with terms that are not, and 1 ms for a
        mechanism of two bodies, whose state is estimated from the first 2048 samples in as long as ten simulations of these.

        Parameters
        ----------
        torque : array_like, shape (m,) or (masses, m) of a trial; (trials, m), (trials, masses, m) or a list of several
            Torques at the record's sample rate; as long as the record if elements change with time, of trials at most as long.
        initial : array_like, shape (2,) or (2, masses); (trials, 2) or (trials, 2, masses), optional
            Angles and velocities at the first sample. By default the state in which the record began, estimated from its angles by
            least squares.
        angle : array_like or list, as the torque, optional
            The angles that were recorded with these torques, from which the state at the first sample is estimated instead.
        phase : array_like or list, as the torque, optional
            The phase of every sample, where trials were aligned on one; by default that of the trials that were identified.
        base : array_like, shape (m,) or (trials, m), or a list, optional
            Motion of a base that moves; by default that of the record.

        Returns
        -------
        ndarray, the torque's shape, or a list of them
            Angles in rad.

        Raises
        ------
        ValueError
            If something cannot be known, shapes do not match, the record is not there to tell the state, or the response leaves the
            range of numbers or depends on the steps.

        See Also
        --------
        vaf : compares it with recorded angles.
        Identification.simulate : of one record.

        References
        ----------
        C. Moler, C. Van Loan: Nineteen dubious ways to compute the exponential of a matrix, SIAM Review 45 (2003), for linear equations.
        """
        several = self._trials("torque", torque)
        angles = None if angle is None else self._trials("angle", angle)
        if angles is not None and [one.shape for one in angles] != [one.shape for one in several]:
            shapes = ([one.shape for one in of] for of in (angles, several))
            raise ValueError(
                "angle and torque must have the same shape; got {} and {}; cut one of them".format(*map(str, shapes))
            )
        begins_once(initial, angle)
        states = None if initial is None else self._states(initial, len(several))
        positions = self._positions(phase, several)
        found = []
        for trial, pushed in enumerate(several):
            position = None if positions is None else positions[trial]
            moving = self._base(base, trial, pushed.shape[1])
            model = self._model(pushed.shape[1], position, moving)
            state = None if states is None else states[trial]
            recorded_angle = None if angles is None else angles[trial]
            if state is None and recorded_angle is None:
                state, recorded_angle = self._begun(trial, pushed, len(several))
            found.append(model.respond(bridged(pushed), state, recorded_angle)[0])
        return self._as_given(torque, found)

    def vaf(
        self,
        angle: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
        torque: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
        *,
        phase: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
        base: npt.ArrayLike | None = None,
    ) -> Any:
        """Return the variance accounted for: how much of recorded angles the simulated ones explain, in percent.

        Parameters
        ----------
        angle, torque : array_like or list, shapes as in :meth:`simulate`, optional
            A recording, best one that was not used to identify; by default the one that was.
        phase, base : array_like, optional
            Of that recording, as in :meth:`simulate`.

        Returns
        -------
        ndarray, shape (masses,), (trials,) or (trials, masses); a float for one trial of shape (m,)

        Raises
        ------
        ValueError
            As in :meth:`simulate`, and if only one of the channels is given.

        See Also
        --------
        simulate : the angles that are compared.
        Identification.vaf : of one record, with the equation.
        held_back : of parts that were not used to identify.

        References
        ----------
        L. Ljung: System identification, theory for the user (1999), on comparing simulated and recorded outputs.
        """
        both_or_none(angle, torque)
        recorded_angle: Any = angle
        pushed: Any = torque
        if angle is None:
            recorded = self._record("angle= and torque=")
            counts = [rows_of(one).shape[1] for one in recorded.angles]
            recorded_angle, pushed = (
                [rows_of(one, count) for one, count in zip(of, counts, strict=True)]
                for of in (recorded.angles, recorded.torques)
            )
            if not self._merging.masses:
                recorded_angle, pushed = ([one[0] for one in of] for of in (recorded_angle, pushed))
            elif self._merging.trials == 1:
                recorded_angle, pushed = recorded_angle[0], pushed[0]
        simulated = self._trials("angle", self.simulate(pushed, angle=recorded_angle, phase=phase, base=base))
        shares = [
            accounted_for(one, found)
            for one, found in zip(self._trials("angle", recorded_angle), simulated, strict=True)
        ]
        if not self._merging.masses:
            return float(shares[0][0]) if self._is_alone(recorded_angle) else np.concatenate(shares)
        return shares[0] if self._is_alone(recorded_angle) else np.stack(shares)

    @property
    def _dimensions(self) -> int:
        """Dimensions of a channel of one trial: time, and masses where there are several."""
        return 2 if self._merging.masses else 1

    def _is_alone(self, values: Any) -> bool:
        """Return whether a channel is of one trial, not of several."""
        inner = values[0] if isinstance(values, list | tuple) and len(values) else values
        return np.ndim(inner) + (inner is not values) == self._dimensions

    def _trials(self, name: str, values: Any) -> list[Array]:
        """Return a channel by trial, each of shape (masses, m)."""
        if not arguments.is_several(values):
            raise TypeError(
                f"{name} must be an array, or a list of one for each trial; got {arguments.shown(values)}; pass its samples"
            )
        each = [values] if self._is_alone(values) else list(values)
        several = [np.asarray(in_units_of(self.units, name, one), np.float64) for one in each]
        masses = self._merging.masses
        for one in several:
            if one.ndim != self._dimensions or (masses and len(one) != masses):
                expected, cure = (f"({masses}, m)", "a row for each mass") if masses else ("(m,)", "one row")
                raise ValueError(f"{name} must have shape {expected} in every trial; got {one.shape}; give {cure}")
        return several if masses else [one[np.newaxis] for one in several]

    def _as_given(self, torque: Any, found: list[Array]) -> Any:
        """Return angles in the shape of the torques."""
        rows = found if self._merging.masses else [one[0] for one in found]
        if self._is_alone(torque):
            return rows[0]
        return np.stack(rows) if len({row.shape for row in rows}) == 1 else rows

    def _states(self, initial: npt.ArrayLike, trials: int) -> list[Array]:
        """Return angles and velocities at the first sample, shape (2, masses), of every trial."""
        given = np.asarray(arguments.real_array("initial", initial), np.float64)
        one = (2, self._merging.masses) if self._merging.masses else (2,)
        if given.shape not in {one, (trials, *one)}:
            raise ValueError(
                f"initial must have shape {one} or {(trials, *one)}, angles and velocities; got {given.shape}; give both of each"
            )
        if not np.isfinite(given).all():
            raise ValueError(f"initial must be finite; got {arguments.shown(initial)}; give angles and velocities")
        return list(np.broadcast_to(given, (trials, *one)).reshape(trials, 2, -1))

    def _positions(self, phase: Any, torques: Sequence[Array]) -> Sequence[Array] | None:
        """Return the sample of the result that every sample of every trial belongs to; None where it is the sample itself."""
        merging = self._merging
        if merging.phase is None:
            if phase is not None:
                raise ValueError("phase= must go with trials that were aligned on one; got it for others; leave it out")
            return None
        if merging.is_part:
            raise ValueError("a phase runs over a whole result; got a part of one; simulate with the whole")
        if phase is None:
            known = self._record("phase=").positions or ()
            if [one.size for one in known] != [one.shape[1] for one in torques]:
                raise ValueError(
                    "the phase of every sample must be known; got torques of other lengths than those that were identified; give phase="
                )
            return known
        each = [phase] if self._is_alone(phase) else list(phase)
        found = [np.asarray(arguments.real_array("phase", one), np.float64) for one in each]
        if [one.shape for one in found] != [one.shape[1:] for one in torques]:
            raise ValueError(
                "phase must have a value for every sample of the torque; got other lengths; cut one of them"
            )
        return [one * merging.samples for one in found]

    def _base(self, base: Any, trial: int, samples: int) -> Array | None:
        """Return the motion of the base in a trial; None where it does not move."""
        if not self._merging.base_moves:
            if base is not None:
                raise ValueError("base= must go with a Chain whose base moves; got it for another; leave it out")
            return None
        bases: Any = self._record("base=").bases if base is None else base
        alone = base is not None and np.ndim(base[0]) == 0
        given = bases if alone else bases[trial] if trial < len(bases) else ()
        moving = np.asarray(in_units_of(self.units, "angle", given), np.float64)
        if moving.shape != (samples,):
            raise ValueError(
                f"base must have shape ({samples},), as the torque's time has; got {moving.shape}; give the base of these torques"
            )
        return np.asarray(bridged(moving[np.newaxis])[0])

    def _begun(self, trial: int, pushed: Array, trials: int) -> tuple[Array | None, Array | None]:
        """Return the state in which a trial that was identified began, or its angles where these are its torques."""
        recorded = self._record("initial=, or angle= of the same recording")
        if trials != self._merging.trials:
            raise ValueError(
                f"the state at the first sample must be known; got {trials} trials, where {self._merging.trials} were identified; "
                "give initial=, or angle= of the same recording"
            )
        angles = rows_of(recorded.angles[trial])
        torques = rows_of(recorded.torques[trial], angles.shape[1])
        if np.array_equal(torques, pushed, equal_nan=True):
            return None, angles
        position = None if recorded.positions is None else recorded.positions[trial]
        base = recorded.bases[trial]
        model = self._model(angles.shape[1], position, None if base is None else bridged(rows_of([base]))[0])
        return model.respond(bridged(torques), None, angles)[1], None

    def _record(self, cure: str) -> MergedRecorded:
        """Return the record that was identified, if it is still there."""
        return still_there(self._merging.recorded, cure)

    def _model(self, samples: int, position: Array | None, base: Array | None) -> Responding:
        """Return the equations of one trial, along its samples."""
        merging = self._merging
        lost = [name for name, verdict in self.identifiable.items() if not verdict]
        if lost:
            raise ValueError(
                f"all elements must be known to be simulated; got {lost[0]}, of which {self.identifiable[lost[0]].reason}; "
                "held_back() compares torques"
            )
        changing = [name for name, kind in self.kinds.items() if kind == "windowed"]
        fits = samples == merging.samples if merging.masses else samples <= merging.samples
        if changing and position is None and not fits:
            raise ValueError(
                f"torque must have {'the' if merging.masses else 'at most the'} record's {merging.samples} samples where elements change "
                f"with "
                f"time; got {samples}; give as many, or identify {' and '.join(changing)} as constant"
            )
        values = {}
        for name, value in self.elements.items():
            along = every_sample(without_gaps(value), merging.samples, merging.step)
            if name not in changing:
                values[name] = np.full(samples, along[0])
            elif position is None:
                values[name] = along[:samples]
            else:
                values[name] = np.interp(position, np.arange(merging.samples), along)
        return model_of(merging, values, base)


def rows_of(channels: Sequence[Any], samples: int | None = None) -> Array:
    """Return channels of masses as an array; those that were not measured are missing, all of them where the samples are counted."""
    if samples is None:
        samples = max(np.size(one) for one in channels if one is not None)
    return np.stack([np.full(samples, np.nan) if one is None else np.asarray(one, np.float64) for one in channels])


def bridged(channels: Array) -> Array:
    """Return channels with straight lines over few missing samples.

    Raises
    ------
    ValueError
        If more are missing in a row.
    """
    missing = ~np.isfinite(channels)
    if not missing.any():
        return channels
    for row, lacks in enumerate(missing):
        first, end = stretches_of(lacks)
        longest = int(np.max(end - first, initial=0))
        if longest > _BRIDGED:
            raise ValueError(
                f"what drives a simulation must be there; got {longest} missing samples in a row of channel {row}, where {_BRIDGED} can "
                "be bridged; cut the recording there, or fill them"
            )
    return without_gaps(channels)
