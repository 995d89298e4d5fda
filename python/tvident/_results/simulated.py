"""Does the model hold? Simulation of what was identified, in comparison with a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import COEFFICIENTS, OFFSET
from tvident._results.held_back import (
    MORE_PARTS,
    PARTS,
    HeldBack,
    ends_of_stretches,
    held_back_of,
    judged,
    parts_of,
    responses_of,
    stretch_of,
    without_masked,
)
from tvident._results.recorded import Recorded, begins_once, both_or_none, still_there
from tvident._results.response import Model, accounted_for, every_sample, samples_of
from tvident._results.torque import POLYNOMIALS, SHORTEST, compared
from tvident._status import Status
from tvident._units import LINEAR, ROTARY, factor_said, scaled

Array: TypeAlias = npt.NDArray[np.float64]

POOR = 2.0
"""Beside a gap values count whose errors are up to so many times the usual ones."""

_AT_ONCE = 2
"""Stretches of a long record that are identified at the same time."""


class Simulated:
    """The part of a result that is compared with records.

    Attributes
    ----------
    time, inertia, damping, stiffness, terms, constants, settings, status, stderr, units :
        Those of the result.
    """

    time: Array
    inertia: Array
    damping: Array
    stiffness: Array
    terms: dict[str, Array]
    constants: dict[str, tuple[Any, Any]]
    settings: dict[str, Any]
    status: npt.NDArray[np.uint16]
    stderr: Mapping[str, Array]
    units: Mapping[str, str]

    def __init__(self, recorded: Recorded | None) -> None:
        self._recorded = recorded
        self._held_back: HeldBack | None = None
        self._rests: dict[tuple[tuple[int, int, int], ...], Model] = {}

    def simulate(
        self, torque: npt.ArrayLike, initial: npt.ArrayLike | None = None, *, angle: npt.ArrayLike | None = None
    ) -> Array:
        r"""Return the angle with which the identified system responds to a torque.

        Between two samples parameters are the mean of theirs there and the torque is linear, for which the response is exact; terms that
        are not linear are integrated with a relative error of about 1e-9, and dry friction sticks and breaks away. Gaps of a parameter of
        at most one test function get the nearest value. What is missing for longer, and torque that is missing for more than 3 samples,
        leaves NaN: behind it the response begins anew if an angle tells in which state.

        Costs about 10 ns a sample where all is constant, 0.1 µs where parameters change, and three times as much where the state is
        estimated; with further terms about 1 µs, and 20 µs for the first 8192 samples where the state is estimated.

        Parameters
        ----------
        torque : array_like, shape (\*, m)
            Torque at the record's sample rate, in N m or in the unit that a :class:`Channel` says; as long as the record if parameters
            change with time.
        initial : array_like, shape (2,) or (\*, 2), optional
            Angle in rad and velocity in rad/s at the first sample. By default the state in which the record began, estimated by least
            squares from its angle.
        angle : array_like, the torque's shape, optional
            The angle that was recorded with this torque, from which the initial state is estimated instead.

        Returns
        -------
        ndarray of float64, the torque's shape
            Angle in rad.

        Raises
        ------
        ValueError
            If shapes do not match, the record is not there to tell the state, or the response leaves the range of numbers, as that of an
            unstable system does.

        See Also
        --------
        vaf : compares it with a recorded angle.
        held_back : the same of parts that were not used to identify.
        predicted_torque : compares torques, and needs no state to begin in.

        References
        ----------
        A. H. Al-Mohy, N. J. Higham: Computing the action of the matrix exponential, SIAM Journal on Scientific Computing 33 (2011).
        J. D. Lawson: Generalized Runge-Kutta processes for stable systems, SIAM Journal on Numerical Analysis 4 (1967), for further terms.
        """
        torques = self._channel("torque", torque)
        model = self._model(samples=torques.shape[-1])
        model.check(torques)
        begins_once(initial, angle)
        if angle is not None:
            return model.respond(torques, angle=_like_torque("angle", self._channel("angle", angle), torques))[0]
        if initial is None:
            recorded = self._record("initial=, or angle= of the same recording")
            if np.array_equal(recorded.torques, torques, equal_nan=True):
                return model.respond(torques, angle=recorded.angles)[0]
            began = model.respond(recorded.torques, angle=recorded.angles)
            return model.respond(torques, initial=np.stack([one[..., 0] for one in began], axis=-1))[0]
        state = arguments.real_array("initial", initial).astype(np.float64)
        if state.shape[-1:] != (2,) or not np.isfinite(state).all():
            raise ValueError(
                f"initial must be a finite angle and velocity; got {arguments.shown(initial)}; give (angle, velocity)"
            )
        return model.respond(torques, initial=np.broadcast_to(state, (*torques.shape[:-1], 2)))[0]

    def vaf(self, angle: npt.ArrayLike | None = None, torque: npt.ArrayLike | None = None) -> Any:
        r"""Return the variance accounted for: how much of a recorded angle the simulated one explains, in percent.

        It is 100 (1 - var(angle - simulated)/var(angle)), over the samples that have both: 100 for a perfect model, 0 for one that
        explains nothing, less for one that is worse than none. The state at the beginning is estimated from the angle.

        Parameters
        ----------
        angle, torque : array_like, shape (\*, m), optional
            A recording, best one that was not used to identify; by default the one that was.

        Returns
        -------
        float or ndarray, shape (\*)
            One number a record; NaN where nothing could be simulated.

        Raises
        ------
        ValueError
            As in :meth:`simulate`, and if only one of the channels is given.

        See Also
        --------
        simulate : the angle that is compared.
        held_back : of parts that were not used to identify.

        References
        ----------
        L. Ljung: System identification, theory for the user (1999), on comparing simulated and recorded outputs.
        """
        both_or_none(angle, torque)
        if angle is None or torque is None:
            recorded = self._record("angle= and torque=")
            angle, torque = recorded.angles, recorded.torques
        torques = self._channel("torque", torque)
        angles = _like_torque("angle", self._channel("angle", angle), torques)
        share = accounted_for(angles, self.simulate(torques, angle=angles))
        return share if share.ndim else float(share)

    def predicted_torque(self) -> tuple[Array, Array, Array]:
        """Return the recorded torque, and the one that the identified equation predicts from the recorded angle.

        Both are as the method compares them: in weak form averages over the test function, in which the noise of derivatives is small; in
        strong form the torque as it is, and derivatives of the local polynomials. Costs about 0.1 µs a sample.

        Returns
        -------
        time, recorded, predicted : ndarray, shape (m,)
            Seconds and N m, for every sample of the record; NaN near its ends and near what is missing.

        Raises
        ------
        ValueError
            If there are several records, or the record is not there any more.

        See Also
        --------
        plot : draws both, with ``"torque"``.
        vaf : compares angles instead.

        References
        ----------
        Equations (1) and (A) of docs/mathematics.md and docs/automatic.md.
        """
        if self.inertia.ndim != 1:
            raise ValueError(
                f"only a single record has a predicted torque; this one has shape {self.inertia.shape}; take one record"
            )
        recorded = self._record("a result of identify, in the process that identified")
        found, predicted = compared(self._model(), recorded.angles, recorded.torques, self.settings)
        start = float(self.time[0]) if self.time.size else 0.0
        return start + np.arange(found.size) / float(self.settings["sample_rate"]), found, predicted

    def held_back(self) -> HeldBack:
        """Return how much the model explains of a part of the record that it is not fitted to: the last tenth of every tenth.

        Parameters are identified once more without these samples, with the settings of this result, and interpolated between the others.
        Of a long record (at 1 kHz from 11 minutes on) the same is done in a stretch at the end of every tenth, of 33 s or a hundred test
        functions, from as many samples on either side as are held back of it; what is not windowed can hardly follow so few, and is not
        identified once more.
        Samples that a mask leaves out do not count, nor those behind them whose state would be told by samples before them.
        It is done when it is asked for first, by :meth:`summary` too, and takes about as long as to identify with ``settings=``.

        Returns
        -------
        HeldBack
            ``simulated``: percent of the angle's variance that is explained from the state before each held-back part; ``predicted``: one
            test function ahead; ``why_not``: why there are no numbers.

        Raises
        ------
        KeyboardInterrupt
            If it is interrupted.

        See Also
        --------
        vaf : of any recording.
        summary : begins with it.

        References
        ----------
        M. Stone: Cross-validatory choice and assessment of statistical predictions, Journal of the Royal Statistical Society B 36 (1974).
        """
        if self._held_back is None:
            self._held_back = self._hold_back()
        return self._held_back

    def _hold_back(self, ahead: int | None = None) -> HeldBack:
        """Return how much the model explains of what it is not fitted to: of the last tenth of every tenth, one test function ahead.

        Or so many samples ahead, of more parts that are as short: then what changes is known beside each.
        """
        recorded = self._recorded
        if recorded is None:
            return HeldBack(
                why_not="the record was not kept with the result; vaf(angle, torque) compares with a record"
            )
        if not recorded.is_unchanged:
            return HeldBack(why_not="the record's arrays hold other samples by now; pass copies to identify")
        if self.inertia.size == 0:
            return HeldBack(why_not="there is no record")
        length = self.settings["window_length"]
        length = int(np.max(length)) if isinstance(length, list) and length else length
        length = ahead or length
        samples = recorded.angles.shape[-1]
        some = ends_of_stretches(samples, length) if ahead is None and isinstance(length, int) else []
        if some and self._is_told_by_stretches:
            found = self._hold_back_of(some, length)
            if not found.why_not:
                return found
        parts = parts_of(samples, length if isinstance(length, int) else 1, PARTS if ahead is None else MORE_PARTS)
        try:
            model = self._rest_of(parts, recorded)
            asked = ahead is None
            parts = without_masked(parts, recorded.mask, length if isinstance(length, int) else 1)
            responses = responses_of(model, recorded.angles, recorded.torques, parts, length, simulated=asked)
            found = judged(recorded.unmasked(), responses, parts, simulated=asked)
            return found if found.why_not else replace(found, ahead=length * model.period)
        except ValueError as error:
            return HeldBack(why_not=str(error))

    @property
    def _is_told_by_stretches(self) -> bool:
        """Whether stretches of the record are records of their own, in which what is not windowed can be taken as known."""
        recorded = self._recorded
        return recorded is not None and recorded.again_in is not None and not self.settings["own_terms"]

    def _hold_back_of(self, ends: list[slice], length: int) -> HeldBack:
        """Return the same of ends of stretches of a long record. What is not windowed can hardly follow so few samples, and is known."""
        from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415 - for long records alone

        recorded, model = self._recorded, self._model()
        assert recorded is not None  # noqa: S101 - asked before
        _, first, end = held_back_of(ends[0].stop - ends[0].start)

        def responses(some: slice) -> list[Array]:
            rest = self._rest_of_stretch(some, slice(first, end), model)
            parts = without_masked([(0, first, end)], recorded.mask_in(some), length)
            found = responses_of(rest, recorded.angles[some], recorded.torques[some], parts, length)
            return [response[first:end] for response in found]

        # Of one stretch not all work has several parts.
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            try:
                simulated_and_predicted = map(np.concatenate, zip(*pool.map(responses, ends), strict=True))
            except ValueError as error:
                # So little of it is there that nothing can be identified, while the whole record tells something.
                return HeldBack(why_not=str(error))
            finally:
                pool.shutdown(wait=False, cancel_futures=True)
        angle = np.concatenate([recorded.unmasked(some)[first:end] for some in ends])
        parts = [(start, start, start + end - first) for start in range(0, angle.size, end - first)]
        told = judged(angle, simulated_and_predicted, parts)
        ahead, stretch = length * model.period, stretch_of(length) * model.period
        return told if told.why_not else replace(told, ahead=ahead, stretch=stretch)

    def _rest_of_stretch(self, some: slice, held: slice, model: Model) -> Model:
        """Return what is identified of a stretch without what is held back of it: what is windowed, and terms."""
        recorded, kinds = self._recorded, self.settings["kinds"]
        assert recorded is not None and recorded.again_in is not None  # noqa: S101, PT018 - asked before
        if "windowed" not in kinds.values():
            return replace(model, values={name: _within(value, some) for name, value in model.values.items()})
        angle = recorded.angles[some].astype(np.float64)
        angle[held] = np.nan
        values = {name: model.values[name] for name in COEFFICIENTS if kinds.get(name) != "windowed"}
        known = {name: value if value.size > 1 else float(value[0]) for name, value in values.items()}
        rest = recorded.again_in(angle, some, known)
        found: Model = rest._model(rest._beside_gaps())  # noqa: SLF001 - of this class
        return found

    def _rest_of(self, parts: list[tuple[int, int, int]], recorded: Recorded) -> Model:
        """Return what is identified without the ends of some parts; once for several distances that are predicted of more parts."""
        asked = tuple(parts)
        if asked in self._rests:
            return self._rests[asked]
        angles = recorded.angles.astype(np.float64)
        for _, first, end in parts:
            angles[..., first:end] = np.nan
        rest = recorded.again(angles)
        model: Model = rest._model(rest._beside_gaps())  # noqa: SLF001 - of this class
        if len(parts) > PARTS:
            self._rests[asked] = model
        return model

    @np.errstate(all="ignore")
    def _beside_gaps(self) -> npt.NDArray[np.bool_]:
        """Return where windows beside a gap hold so few equations that values between the gap's sides are better than these."""
        poor = np.zeros(self.status.shape, bool)
        for name in ("inertia", "damping", "stiffness", *self.terms):
            error = self.stderr[name]
            there = np.isfinite(error)
            usual = np.median(error[there]) if there.any() else np.inf
            poor |= error > POOR * usual
        return np.asarray(poor & (self.status & (Status.GAP | Status.EDGE) != 0))

    def _record(self, cure: str) -> Recorded:
        """Return the record that was identified, if it is still there."""
        return still_there(self._recorded, cure)

    def _channel(self, name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
        return in_units_of(self.units, name, values)

    def _model(self, without: npt.NDArray[np.bool_] | None = None, *, samples: int = 0) -> Model:
        """Return the equation of motion that was found, with nothing at samples that are left out; at so many where no record says it."""
        s = self.settings
        recorded = self._recorded
        own = {} if recorded is None else recorded.own
        missing = [name for name in s["own_terms"] if name not in own]
        if missing:
            raise ValueError(
                f"terms must be there to be simulated; the function of {missing[0]!r} was not stored with the result; identify again"
            )
        values = {"inertia": self.inertia, "damping": self.damping, "stiffness": self.stiffness, **self.terms}
        period, step = 1 / s["sample_rate"], s["step"]
        count = samples_of(self.time.size, step, samples) if recorded is None else recorded.angles.shape[-1]

        alone = {name for name in values if name in self.constants}
        if "angle_zero" in self.constants:
            # K (θ - θ₀): the spring's torque at the encoder's zero is one more offset, which changes as the stiffness does.
            zero = np.asarray(self.constants["angle_zero"][0])[..., np.newaxis]
            values[OFFSET] = values[OFFSET] - zero * self.stiffness
            alone.discard(OFFSET)

        def prepared(name: str, value: Array) -> Array:
            if name in alone or isinstance(s["known"].get(name), int | float):
                return value[..., :1]
            value = value if without is None else np.where(without, np.nan, value)
            return every_sample(value, count, step)

        length = s["window_length"]
        lag = s.get("lag_samples") or [
            late / period for late in (s["lag"] if isinstance(s["lag"], list) else [s["lag"]])
        ]
        records = int(np.prod(self.inertia.shape[:-1], dtype=int))
        return Model(
            values={name: prepared(name, value) for name, value in values.items()},
            own=own,
            period=period,
            start=float(self.time[0]),
            lags=lag * records if len(lag) == 1 else lag,
            bridged=int(np.max(length)) if length else 0,
            stribeck=np.ravel(s["inner"].get("stribeck.velocity", [])).tolist(),
        )

    def __getstate__(self) -> dict[str, Any]:
        # A record may be long, and functions of terms cannot be stored; what was found of it stays.
        return self.__dict__ | {"_recorded": None, "_rests": {}}


def _within(value: Array, some: slice) -> Array:
    """Return a stretch of what changes, or what is constant."""
    return value[..., some] if value.shape[-1] > 1 else value


def predicted_ahead(result: Simulated, ahead: int | None) -> tuple[float, float]:
    """Return how much of what is held back is predicted so many samples ahead, in percent; and how much where nothing sudden happens.

    By default one test function ahead, of the parts of :meth:`Simulated.held_back`. NaN where that is not known.
    """
    found = result.held_back() if ahead is None else result._hold_back(ahead)  # noqa: SLF001 - of this file
    return float(np.max(found.predicted)), found.steady


@np.errstate(all="ignore")
def predicted_at_samples(result: Simulated) -> Array:
    """Return the torque that the equation of one record predicts at every sample, not averaged, and as late as the recorded one.

    Velocity and acceleration are those of local polynomials in windows half as long as those of the method, whose order is chosen. NaN
    where there is no whole window.
    """
    recorded = result._record("a result of identify")  # noqa: SLF001 - of this file
    model = result._model()  # noqa: SLF001 - of this file
    length = result.settings["window_length"]
    if not isinstance(length, int):
        # Nothing was determined.
        return np.full(recorded.angles.size, np.nan)
    length = max(SHORTEST, length // 2 | 1)
    settings = {"form": "strong", "window_length": length, **POLYNOMIALS}
    _, predicted = compared(model, recorded.angles, recorded.torques, settings)
    late = float(model.lags[0])
    if late == 0:
        return predicted
    places = np.arange(predicted.size, dtype=np.float64)
    return np.asarray(np.interp(places - late, places, predicted, left=np.nan, right=np.nan))


def in_units_of(units: Mapping[str, str], name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return a channel in the unit of a result, by the unit that it says it has."""
    system = ROTARY if units["angle"] == ROTARY.units["angle"] else LINEAR
    return scaled(arguments.channel(name, values), factor_said(system, name, values))


def _like_torque(name: str, array: npt.NDArray[np.number], torque: npt.NDArray[np.number]) -> npt.NDArray[np.number]:
    """Return a channel that has the shape of the torque."""
    if array.shape != torque.shape:
        raise ValueError(
            f"{name} and torque must have the same shape; got {array.shape} and {torque.shape}; cut or reshape one of them"
        )
    return array
