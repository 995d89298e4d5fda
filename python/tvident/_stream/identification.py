"""Parameters of the equation of motion of a recording that comes piece by piece."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import LINEAR_UNITS, UNITS, GivenTerm, Parameter
from tvident._identify import MOST_OF_FIRST, Method
from tvident._pieces import Given
from tvident._status import Status
from tvident._stream.asked import InWeakForm, StreamWork, asked_of
from tvident._stream.pieces import SampleStream, is_plain, not_weighted_alike
from tvident._stream.streamed import Named, StreamedIdentification
from tvident._stream.weak import WeakStream
from tvident._units import ROTARY, axis_of, factor_said, scaled

Numbers = npt.NDArray[np.float64]

_NOTHING = np.empty(0)


class IdentificationStream(SampleStream[StreamedIdentification]):
    r"""Identify I, C and K in I θ̈ + C θ̇ + K θ = T while angle and torque are recorded: :func:`identify`, piece by piece.

    Pieces may hold one sample or millions; memory does not grow with what has come. Parameters in windows of the strong form have the bits
    of :func:`identify` with all samples and the same `nan_policy`, however the stream is cut; those of a sample are given with the sample
    :attr:`delay` samples later. Constants are given from all samples so far, or with older ones forgotten; after the last sample they are
    those of :func:`identify` to rounding.

    A stream holds no more than its windows need. What is chosen from a whole record raises and says so: pass ``settings`` of an earlier
    result, and ``method="auto"`` goes by what that one chose. In weak form blocks of the recording are then identified as records of
    their own, with neighbours on both sides; constants are those of all blocks so far, and pieces change no bit. A recording of one block
    has the bits of :func:`identify`; see Notes for longer ones.

    Parameters
    ----------
    sample_rate, delta : float
        Samples per second, or the sample period in seconds. Give exactly one.
    angle_unit, torque_unit : str, optional
        As in :func:`identify`.
    method : {"auto", "paper"} or StrongForm
        ``"auto"`` with settings of an earlier result. The strong form, with settings of the paper or of your own, without
        ``selection="pooled"``, ``filter_torque`` and linear variation.
    inertia, damping, stiffness : {"windowed", "constant"} or float, optional
        As in :func:`identify`, numbers where they are known. In strong form what is unknown is all windowed or all constant.
    terms : sequence, optional
        Built-in terms, as in :func:`identify`.
    quantisation : float, optional
        Step to which the angle was rounded; by default none.
    nan_policy : {"propagate", "raise", "omit"}, optional
        Missing samples: windows that hold one are NaN, or an error. Constants leave their equations out. With ``"omit"`` windows of
        polynomials that hold short gaps are fitted on what is there, and equations that are missing are left out of their windows, as
        :func:`identify` does.
    step : int, optional
        Every how many samples a result is wanted.
    settings : mapping, optional
        Settings of an earlier result: its choices are used, and what it found of the scatter of windows is in the standard errors.
    half_life : float or str, optional
        For constants: after how many samples, or after which time, ``"10 s"``, an equation counts half. By default all count the same.
    start : float, optional
        Time of the first sample in seconds.

    Attributes
    ----------
    delay : int
        Samples from one to its parameters. In strong form half a window of the polynomials, half of the span of windows that are
        reached from one start, and half a regression window where parameters are windowed. In weak form twice the sum of the window and
        four regression windows, less one. In strong form, with ``nan_policy="omit"`` or weights, samples within half a window of the
        polynomials and the longest gap that is followed must have come.
    samples : int
        Samples that have come so far.
    names : list of str
        What is unknown.
    units : dict of str to str
        Their units.
    hold : bool
        While it is true, equations that come are left out, and constants stay as they are.
    record_status : Status
        In weak form flags of the latest block, those of what may be missing of the latest that was asked, and KIND_CONTRADICTED where
        constants of blocks differ by more than chance.

    Raises
    ------
    ValueError
        If something needs the whole record, windows are too short, nothing is unknown, or a name is unknown.
    TypeError
        If there is no sample period, or a number is not whole.

    See Also
    --------
    identify : the same for a whole record.
    LocalPolynomialStream : derivatives alone.
    RollingStream : least squares alone.

    Notes
    -----
    Equations (2) to (4), (8) and (9) of the paper, in the order in which samples come. Standard errors of windowed parameters are those of
    least squares times the scatter of windows that share no equation, as far as it is known: NaN before there are enough of them, about
    three times the regression window and a half of the other. Those of constants know of neighbouring equations that share samples, from
    the latest 16 384; they are renewed each time that the number of equations has doubled.

    In weak form a whole record knows what a block does not: its noise, constants from samples to come, and which lengths of windows
    predict best over all of it. With ``averaging=False`` and numbers for what is constant, windows differ by the noise alone, on the whole
    a hundredth of their standard error; otherwise by some 0.6 of it, as their errors say, which are made from the block. A block
    has at least 1024 samples before it, and after it a third of what windows reach; one sample costs some 3 µs, 4 ms a block. Every
    fifth block is asked what may be missing in the equation, or the next that does not lie in a gap.

    ``half_life``, :attr:`hold` and :meth:`reset` are what MATLAB's ``recursiveLS`` has as ``ForgettingFactor`` (2 to the power
    of minus one over the half-life in samples), ``EnableAdaptation`` and ``reset``.

    A stream pickles with what it still needs and goes on where it was, on another machine too.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    L. Ljung: System Identification, 2nd edition, 1999, section 11.2: recursive least squares with forgetting.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> stream = tvident.IdentificationStream(sample_rate=1000, method="paper")
    >>> stream.push(rig.angle[:1000], rig.torque[:1000]).time.size == 1000 - stream.delay
    True
    >>> out = stream.push(rig.angle[1000:], rig.torque[1000:])
    >>> batch = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    >>> places = np.round(out.time * 1000).astype(int)
    >>> np.array_equal(out.stiffness, batch.stiffness[places])
    True

    In weak form, with what an earlier recording chose:

    >>> earlier = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> stream = tvident.IdentificationStream(sample_rate=1000, settings=earlier.settings)
    >>> out = stream.push(rig.angle, rig.torque)
    >>> bool(abs(out.inertia[-1] - rig.inertia[-1]) < 3 * out.stderr["inertia"][-1])
    True
    """

    # All are options, as users call it.
    def __init__(
        self,
        *,
        sample_rate: float | None = None,
        delta: float | None = None,
        angle_unit: str | None = None,
        torque_unit: str | None = None,
        method: Method = "auto",
        inertia: Parameter | None = None,
        damping: Parameter | None = None,
        stiffness: Parameter | None = None,
        terms: Sequence[GivenTerm] | None = None,
        lag: float | None = None,
        quantisation: float | None = None,
        period: float | None = None,
        nan_policy: arguments.RowPolicy = "propagate",
        step: int = 1,
        settings: Mapping[str, Any] | None = None,
        half_life: float | str | None = None,
        start: float = 0.0,
    ) -> None:
        if sample_rate is None and delta is None:
            raise TypeError("a stream needs the sample period; got none; give sample_rate= or delta=")
        self._period = arguments.sample_period(0, delta=delta, sample_rate=sample_rate)
        self._axis = axis_of(None, None, angle_unit=angle_unit, torque_unit=torque_unit)
        equation = {
            "inertia": inertia,
            "damping": damping,
            "stiffness": stiffness,
            "terms": terms,
            "lag": lag,
            "quantisation": (
                None
                if quantisation is None
                else arguments.finite_number("quantisation", quantisation) * self._axis.angle
            ),
            "period": period,
        }
        self._policy = arguments.one_of("nan_policy", nan_policy, get_args(arguments.RowPolicy))
        given = Given(method, equation, settings, nan_policy, self._period, self._axis, workers=1)
        self._asked = asked_of(given, half_life)
        self._step = arguments.whole_number("step", step, least=1)
        self._start = arguments.finite_number("start", start)
        self._hold = False
        self._weighted, self._unit = False, 0.0
        self._named = Named(self._asked.equation, self._period, self._start, self._step)
        # Whether an array of floats is taken as it is.
        self._plain = self._policy != "raise" and all(self._factor(name, _NOTHING) == 1 for name in ("angle", "torque"))
        self._stream = self._begun(None)

    def _begun(self, state: Any) -> StreamWork:
        """Return a stream that begins, or goes on from a state."""
        stream = self._asked.begun(self._step, state, weighted=self._weighted)
        stream.hold(self._hold)
        return stream

    @property
    def names(self) -> list[str]:
        """What is unknown, by name: a list of str.

        See Also
        --------
        units : their units.
        push : gives their values.
        """
        return list(self._asked.equation.names)

    @property
    def units(self) -> dict[str, str]:
        """Units of what is unknown: a dict of name to str.

        See Also
        --------
        names : what is unknown.
        """
        units = UNITS if self._axis.system is ROTARY else LINEAR_UNITS
        return {name: units.get(name, "") for name in self._asked.equation.names}

    @property
    def record_status(self) -> Status:
        """Flags of the recording, in weak form: of the latest block, and of constants so far. The strong form judges nothing of it.

        See Also
        --------
        Status : what flags mean.
        Identification.record_status : of a whole record.
        """
        return self._stream.record_status if isinstance(self._stream, WeakStream) else Status(0)

    @property
    def hold(self) -> bool:
        """Whether constants stay as they are: True while held.

        See Also
        --------
        reset : forgets all equations.
        push : goes on with what is not held.
        """
        return self._hold

    @hold.setter
    def hold(self, value: bool) -> None:
        self._hold = arguments.flag("hold", value)
        self._stream.hold(self._hold)

    def reset(self) -> None:
        """Forget all equations so far: constants are those of the equations that follow. Windows forget by themselves.

        See Also
        --------
        hold : keeps constants instead.
        """
        self._stream.reset()

    def push(
        self, angle: npt.ArrayLike, torque: npt.ArrayLike, *, weights: npt.ArrayLike | None = None
    ) -> StreamedIdentification:
        """Take the next samples, and give the parameters that they settle.

        Parameters
        ----------
        angle, torque : float or array_like, shape (m,)
            The next samples, any number of them.
        weights : float or array_like, shape (m,), optional
            Weight of every sample, one over the variance of its noise relative to the others, as in :func:`identify`; a sample of weight 0
            is missing. Samples of a stream all have weights, or none has. In strong form :attr:`delay` may grow with the first ones.

        Returns
        -------
        StreamedIdentification
            Parameters of the next samples up to :attr:`delay` before the last one that has come; empty at first.

        Raises
        ------
        ValueError
            If the stream has ended, lengths differ, a channel holds what is no number where `nan_policy` is ``"raise"``, a weight is
            negative, no finite number or in strong form 1e100 times the first, or only some samples have weights.
        TypeError
            If an array is complex or holds no numbers.

        See Also
        --------
        finish : what is left at the end.
        identify : the same numbers of a whole record.

        References
        ----------
        Equations (1) to (9) of docs/mathematics.md, (A) of docs/automatic.md; the delay is explained in docs/real-time.md.
        """
        self._check_open()
        if weights is not None or self._weighted:
            return self._push_weighted(angle, torque, weights)
        if not (self._plain and is_plain(angle) and is_plain(torque)):
            angle, torque = self._channel("angle", angle), self._channel("torque", torque)
        _check_sizes(angle.size, torque.size)
        return StreamedIdentification(self._stream.push(angle, torque), self._named)

    def _push_weighted(self, angle: Any, torque: Any, weights: npt.ArrayLike | None) -> StreamedIdentification:
        """Take the next samples with their weights."""
        if weights is None or (not self._weighted and self.samples > 0):
            raise not_weighted_alike("samples", have=weights is not None)
        # As many as the angle has samples.
        count = np.size(angle)
        given = arguments.some_weights("weights", weights, (count,))
        _check_sizes(count, np.size(torque))
        counted = given > 0
        angle, torque = self._channel("angle", angle, counted), self._channel("torque", torque, counted)
        unit, relative = self._relative(given)
        # Nothing stays of a piece that is refused.
        if not self._weighted:
            self._weighted = True
            try:
                self._stream = self._begun(None)
            except ValueError:
                self._weighted = False
                raise
        if unit != self._unit:
            self._unit, self._named = unit, replace(self._named, root=math.sqrt(unit))
        # What has no weight is missing.
        angle, torque = (np.where(counted, channel, np.nan) for channel in (angle, torque))
        return StreamedIdentification(self._stream.push(angle, torque, relative), self._named)

    def _relative(self, weights: Numbers) -> tuple[float, Numbers]:
        """Return the first weight that is not zero, 0 before there is one, and weights over it; blocks have each its own unit."""
        if isinstance(self._asked, InWeakForm):
            return 1.0, weights
        unit = self._unit
        if unit == 0.0 and weights.any():
            unit = float(weights[np.argmax(weights > 0)])
        largest = float(weights.max(initial=0.0))
        if largest > MOST_OF_FIRST * unit:
            raise ValueError(
                f"weights of a stream must be at most {MOST_OF_FIRST:.0e} times the first that is not 0; got {largest:.3g} after "
                f"{unit:.3g}; give all of them in one unit"
            )
        with np.errstate(under="ignore"):
            return unit, weights / (unit or 1.0)

    def _channel(
        self, name: Literal["angle", "torque"], values: Any, counted: npt.NDArray[np.bool_] | None = None
    ) -> npt.NDArray[Any]:
        """Return a piece of a channel in the units of the equation, of which only some samples may count."""
        return scaled(self._piece(name, values, counted), self._factor(name, values))

    def _factor(self, name: Literal["angle", "torque"], values: Any) -> float:
        """Return what a piece is multiplied by: by the unit that was given, or else the one that it says."""
        given = self._axis.angle if name == "angle" else self._axis.torque
        return factor_said(self._axis.system, name, values) if name in self._axis.assumed else given

    def _given(self, found: Any) -> StreamedIdentification:
        return StreamedIdentification(found, self._named)

    def __repr__(self) -> str:
        names = ", ".join(self._asked.equation.names)
        return f"<IdentificationStream of {names} after {self.samples} samples, {self._progress()}>"


def _check_sizes(angle: int, torque: int) -> None:
    """Check that both channels have as many samples."""
    if angle != torque:
        raise ValueError(
            f"angle and torque must have as many samples as each other; got {angle} and {torque}; push them together"
        )
