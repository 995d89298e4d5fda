"""Derivatives of samples that come piece by piece."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._choices import Criterion, Selection
from tvident._derivatives import HIGHEST_ORDER, SHORTEST_WINDOW, check_weighted, gaps_given, leaves_out, plan
from tvident._stream.pieces import SampleStream, not_weighted_alike, span_of


@dataclass(frozen=True, eq=False, slots=True)
class StreamedDerivatives:
    """What a :class:`LocalPolynomialStream` gives for some samples, each with one element of every array.

    Attributes
    ----------
    time : ndarray of float64, shape (k,)
        Times of the samples, in seconds.
    derivatives : ndarray of float64, shape (max_deriv + 1, k)
        Value, first, second, … derivative.
    stderr : ndarray of float64, shape (max_deriv + 1, k), or None
        Standard errors, where they were asked for.
    order : ndarray of uint8, shape (k,)
    sigma : ndarray of float64, shape (k,)
    status : ndarray of uint16, shape (k,)
        As in :class:`tvident.LocalPolynomialFit`.
    """

    time: npt.NDArray[np.float64]
    derivatives: npt.NDArray[np.float64]
    stderr: npt.NDArray[np.float64] | None
    order: npt.NDArray[np.uint8]
    sigma: npt.NDArray[np.float64]
    status: npt.NDArray[np.uint16]

    def __repr__(self) -> str:
        return f"<StreamedDerivatives at {span_of(self.time, 'samples', 'time')}>"


@arguments.called_as("LocalPolynomialStream(201, sample_rate=1000)")
class LocalPolynomialStream(SampleStream[StreamedDerivatives]):
    """Differentiate samples as they come: :func:`fit_local_polynomials`, piece by piece.

    Pieces may hold one sample or millions. The numbers are those of one call with all samples, bit for bit, however the stream is cut;
    the estimate of a sample is given with the sample :attr:`delay` samples later, and none before the first window is full. Memory does
    not grow with what has come. Samples may be missing, or have weights.

    Parameters
    ----------
    window_length : int or str
        Samples in a window, odd, at least 5; or a duration such as ``"0.2 s"``. ``"auto"`` needs the whole record.
    delta, sample_rate : float, optional
        Sample period in seconds, or samples per second. Give at most one; by default the period is 1.
    max_order, order, criterion, max_deriv, step
        As in :func:`fit_local_polynomials`.
    selection : {"window", "average"}, optional
        As in :func:`fit_local_polynomials`; ``"pooled"`` looks at neighbours on both sides, and is not for streams.
    nan_policy : {"propagate", "omit", "raise"}, optional
    max_gap : int or str, optional
    min_observations : int, optional
        As in :func:`fit_local_polynomials`. What windows that lack samples hold is known a window and the longest gap later.
    quantisation : float, optional
        Step to which samples were rounded; by default 0, none: it cannot be found before the samples are there. That of an earlier
        recording is in ``fit.settings["quantisation"]``.
    stderr : bool, optional
        Give standard errors too. Where the order is chosen they cost far more than the estimates.
    start : float, optional
        Time of the first sample in seconds.

    Attributes
    ----------
    delay : int
        Samples from one to its estimate: half a window, and half of the span of windows that are reached from one start. With
        ``nan_policy="omit"`` or weights at least a window and the longest gap: one and a half windows by default.
    samples : int
        Samples that have come so far.

    Raises
    ------
    ValueError
        If the window is even, shorter than 5 samples or ``"auto"``, an order is too high, or a name is unknown; if `max_gap` or
        `min_observations` is given where windows are to be whole.
    TypeError
        If a number is not whole, or both `delta` and `sample_rate` are given.

    See Also
    --------
    fit_local_polynomials : the same for a whole record.
    IdentificationStream : parameters of the equation of motion as they come.

    Notes
    -----
    Work is done for half a span of windows at a time (a span is 8 to 256 windows, or a quarter of a long window): most pushes of one sample
    only hand over what was made before. Windows that lack samples, or whose samples have weights, are fitted when they are given: some 14
    µs with 201 samples where they come one at a time, 2 µs in longer pieces. A stream pickles with all that it still needs, some windows of
    samples, and goes on where it was, on another machine too; the bits are the batch's where both have the same vector instructions or any
    others.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> y = np.sin(np.arange(2000) / 50) + 1e-3 * np.random.default_rng(0).standard_normal(2000)
    >>> stream = tvident.LocalPolynomialStream(101, sample_rate=1000)
    >>> pieces = [stream.push(some).derivatives for some in np.array_split(y, 37)]
    >>> pieces.append(stream.finish().derivatives)
    >>> batch = tvident.fit_local_polynomials(y, 101, sample_rate=1000, quantisation=0)
    >>> np.array_equal(np.concatenate(pieces, axis=1), batch.derivatives)
    True
    """

    # All are options, as users call it.
    def __init__(
        self,
        window_length: int | str,
        *,
        delta: float | None = None,
        sample_rate: float | None = None,
        max_order: int = HIGHEST_ORDER,
        order: int | None = None,
        criterion: Criterion = "aicc",
        selection: Selection = "window",
        max_deriv: int = 2,
        step: int = 1,
        nan_policy: arguments.RowPolicy = "propagate",
        max_gap: int | str | None = None,
        min_observations: int | None = None,
        quantisation: float | None = None,
        stderr: bool = False,
        start: float = 0.0,
    ) -> None:
        period = self._period = arguments.sample_period(0, delta=delta, sample_rate=sample_rate)
        if arguments.is_word(window_length, "auto"):
            raise ValueError(
                "window_length must be known before samples come; got 'auto', which needs the whole record; give window_length of an "
                "earlier fit"
            )
        if arguments.one_of("selection", selection, get_args(Selection)) == "pooled":
            raise ValueError(
                "selection must be 'window' or 'average' in a stream; got 'pooled', which needs the windows after; use one of these"
            )
        length = arguments.window_length("window_length", window_length, period, odd=True)
        if length < SHORTEST_WINDOW:
            raise ValueError(
                f"window_length must be at least {SHORTEST_WINDOW} samples; got {length}; use {SHORTEST_WINDOW} or more"
            )
        highest = arguments.whole_number("max_deriv", max_deriv, least=0, most=HIGHEST_ORDER)
        arguments.check_power("max_deriv", highest, period)
        self._plan: dict[str, Any] = {
            "window_length": length,
            "order": None if order is None else arguments.whole_number("order", order, least=0, most=HIGHEST_ORDER),
            "max_order": arguments.whole_number("max_order", max_order, least=0, most=HIGHEST_ORDER),
            "criterion": arguments.one_of("criterion", criterion, get_args(Criterion)),
            "selection": selection,
            "derivatives": tuple(range(highest + 1)),
            "delta": period,
            "noise": True,
            "quantisation": 0.0
            if quantisation is None or (np.ndim(quantisation) == 0 and not quantisation)
            else arguments.positive_number("quantisation", quantisation),
        }
        self._step = arguments.whole_number("step", step, least=1)
        self._stderr = arguments.flag("stderr", stderr)
        self._policy = arguments.one_of("nan_policy", nan_policy, get_args(arguments.RowPolicy))
        # Weights may come with the first samples: what is said of gaps is for them then.
        self._said_of_gaps = max_gap, min_observations
        self._gaps = gaps_given(nan_policy, *self._said_of_gaps, weighted=True, length=length, period=period)
        self._weighted = False
        self._start = arguments.finite_number("start", start)
        self._stream = self._begun(None)

    def _begun(self, state: Any) -> _core.PolynomialStream:
        """Return a stream that begins, or goes on from a state."""
        gaps: dict[str, Any] | None = None
        if self._gaps is not None and (self._weighted or self._gaps.omit):
            gaps = {
                "leaves_out": self._gaps.omit,
                "weighted": self._weighted,
                "longest_gap": self._gaps.longest_gap,
                "least": self._gaps.least,
            }
        return _core.PolynomialStream(plan(**self._plan), step=self._step, errors=self._stderr, gaps=gaps, state=state)

    def push(self, y: npt.ArrayLike, *, weights: npt.ArrayLike | None = None) -> StreamedDerivatives:
        """Take the next samples, and give what they settle.

        Parameters
        ----------
        y : float or array_like, shape (m,)
            The next samples, any number of them.
        weights : float or array_like, shape (m,), optional
            Weight of every sample, one over the variance of its noise relative to the others, as in :func:`fit_local_polynomials`; a
            sample of weight 0 is missing. Samples of a stream all have weights, or none has. :attr:`delay` may grow with the first ones.

        Returns
        -------
        StreamedDerivatives
            Estimates of the next samples up to :attr:`delay` before the last one that has come; empty at first.

        Raises
        ------
        ValueError
            If the stream has ended, `y` has more than one axis, or holds what is no number where `nan_policy` is ``"raise"``; if a weight
            is negative or no finite number, only some samples have weights, orders are averaged beside weights, or `max_gap` or
            `min_observations` was given and neither weights nor ``nan_policy="omit"``.
        TypeError
            If `y` is complex or holds no numbers.

        See Also
        --------
        finish : what is left at the end.
        fit_local_polynomials : the same numbers of a whole record.

        References
        ----------
        Equations (2), (8) and (9) of docs/mathematics.md; the delay is explained in docs/real-time.md.
        """
        self._check_open()
        if weights is None and not self._weighted:
            leaves_out(self._policy, *self._said_of_gaps, weighted=False)
            return self._given(self._stream.push(self._piece("y", y)))
        if weights is None or (not self._weighted and self.samples > 0):
            raise not_weighted_alike("samples", have=weights is not None)
        check_weighted(automatic=False, weighted=True, selection=self._plan["selection"])
        given = arguments.some_weights("weights", weights, (np.size(y),))
        samples = self._piece("y", y, given > 0)
        if not self._weighted:
            self._weighted = True
            self._stream = self._begun(None)
        return self._given(self._stream.push(np.where(given > 0, samples, 0.0), given))

    def _given(self, found: _core.StreamedEstimates) -> StreamedDerivatives:
        first, estimates, errors = found.first, found.estimates, found.stderr
        return StreamedDerivatives(
            self._times(first, estimates.status.size),
            estimates.derivatives,
            errors if self._stderr else None,
            estimates.order,
            estimates.sigma,
            estimates.status,
        )

    def __repr__(self) -> str:
        length = self._plan["window_length"]
        return f"<LocalPolynomialStream after {self.samples} samples, windows of {length}, {self._progress()}>"
