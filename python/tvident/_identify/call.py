"""The function ``identify``: arguments are read and checked, and make one task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack, overload

import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import GivenTerm
from tvident._identify.aligned import Align
from tvident._identify.keywords import explained
from tvident._identify.methods import Method
from tvident._identify.prepared import prepared
from tvident._identify.records import calls_of_records, identify_records, names_shared
from tvident._identify.robust import LossAsked
from tvident._identify.together import Options, identify_together
from tvident._identify.typed import Entries, OfMasses, OfOne
from tvident._results import Identification, IdentifiedRecords

if TYPE_CHECKING:
    from tvident._merged import Chain, Mechanism, MergedIdentification


@overload
def identify(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    dof_axis: int,
    ensemble_axis: int | None = None,
    structure: Chain | Mechanism | None = None,
    **options: Unpack[OfMasses],
) -> MergedIdentification: ...
@overload
def identify(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    ensemble_axis: int,
    phase: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
    **options: Unpack[OfOne],
) -> MergedIdentification: ...
@overload
def identify(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    share: str | Sequence[str],
    **options: Unpack[OfOne],
) -> IdentifiedRecords: ...
@overload
def identify(
    angle: Sequence[npt.NDArray[Any]], torque: Sequence[npt.NDArray[Any]], **options: Unpack[OfOne]
) -> Identification | IdentifiedRecords: ...  # a batch where lengths are equal, which types do not say
@overload
def identify(angle: npt.ArrayLike | None, torque: npt.ArrayLike, **options: Unpack[OfOne]) -> Identification: ...
# All but the data are options, as users call it.
@explained
def identify(
    angle: npt.ArrayLike | None,
    torque: npt.ArrayLike,
    *,
    sample_rate: float | tuple[float, float] | None = None,
    delta: float | tuple[float, float] | None = None,
    t: npt.ArrayLike | tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    angle_unit: str | None = None,
    torque_unit: str | None = None,
    time_unit: str | None = None,
    method: Method = "auto",
    inertia: Entries = None,
    damping: Entries = None,
    stiffness: Entries = None,
    terms: Sequence[GivenTerm] | None = None,
    velocity: npt.ArrayLike | None = None,
    acceleration: npt.ArrayLike | None = None,
    instrument: npt.ArrayLike | None = None,
    lag: float | str | Sequence[float | str] | npt.NDArray[Any] | None = None,
    quantisation: float | None = None,
    mask: npt.ArrayLike | Sequence[npt.ArrayLike | None] | None = None,
    weights: npt.ArrayLike | Sequence[npt.ArrayLike | None] | None = None,
    loss: LossAsked | None = None,
    period: float | None = None,
    share: str | Sequence[str] = (),
    dof_axis: int | None = None,
    structure: Chain | Mechanism | None = None,
    ensemble_axis: int | None = None,
    phase: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
    align: Align = None,
    nan_policy: arguments.RowPolicy = "omit",
    step: int = 1,
    settings: Mapping[str, Any] | None = None,
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> Identification | IdentifiedRecords | MergedIdentification:
    r"""Identify I(t), C(t) and K(t) in I θ̈ + C θ̇ + K θ = T from a recorded angle and torque.

    The torque is that which acts *on* the system, positive in the direction of a positive angle: a spring that pulls back has K > 0. The
    torque with which the system acts on a sensor or a motor has the other sign: pass ``-torque``.

    ::

        frame ──/\/\/── K ──┐
                            ├── I ──→ θ, T    both positive in one direction
        frame ───[ ]──── C ─┘

    In weak form, the default, the equation is multiplied by a test function φ = (1 - x²)^p, which is zero with its slope at both ends of
    a window, and integrated by parts: I⟨φ″θ⟩ - C⟨φ′θ⟩ + K⟨φθ⟩ = ⟨φT⟩. No derivative is estimated, the bias from the angle's noise is
    corrected, and every setting that is not given is chosen from the record: ``summary()`` says what was chosen and why.

    In strong form, the paper's, polynomials of every order are fitted to the angle in a window around every sample. The order with the
    smallest Akaike information criterion (equations (2), (8) and (9) of the paper) gives θ̇ and θ̈. In a second window of 200 such
    equations, the regression window, the unknowns are estimated by least squares ((3) and (4)).

    Parameters
    ----------
    angle : array_like, shape (\*, n), or list of them, or None
        Angle in rad; a list of records of different lengths gives a result for each, the same as calls one by one, and then `mask`, `t`,
        `sample_rate` and whatever has a value for every sample may be lists too; a record that is too short has NaN alone. None where
        `velocity` or `acceleration` was measured in its place. Time is the last axis; any others are a batch of records. Masked samples are
        missing, as NaN is. Tables of pandas and polars have time along their rows, arrays of xarray along ``time``; their labels come back
        with ``to_pandas()``, ``to_polars()`` and ``to_xarray()`` of the result. A column, shape (n, 1), is one record.
    torque : array_like, same shape
        Torque in N m.
    sample_rate : float or (float, float)
        Samples per second. Give exactly one of `sample_rate`, `delta` and `t`, or an angle with an index of dates, or of seconds that is
        called `t` or `time` (``time [s]``), as coordinates of xarray may be. Two numbers are the rates of angle and torque, which begin at
        the same time and may have different lengths; a list has one such pair a record.
    delta : float or (float, float)
        Sample period in seconds; two of them, and lists, as rates. Rates, periods, lags and lengths of windows may be quantities of pint
        or astropy, periods and lengths durations of Python, NumPy and pandas too.
    t : array_like, shape (n,)
        Time of every sample: seconds, dates or durations, which increase. Dates, in any time zone, become seconds from the first sample on.
        Where times are uniform to a thousandth of the sample period, or within the digits that they were printed with, only the sample
        rate counts. Otherwise channels are brought onto a uniform grid by splines: see Notes. A tuple of two arrays has the times of the
        angle and those of the torque, which may differ in number, rate and beginning; a list of records takes a list of such tuples.
    angle_unit, torque_unit, time_unit : str, optional
        Units of `angle`, `torque`, and of `t` and `delta`: ``"deg"``, ``"N mm"``, ``"ms"`` and others. By default what an array says of
        itself (a :class:`Channel`, a quantity of pint; of times ``attrs["units"]`` of xarray, too), or else rad, N m and s. A position in
        m, mm or in and a force in N or lbf make the axis linear: results are in kg, N s/m and N/m. `quantisation` and `period` are in the
        unit of the angle, parameters and terms in those of results.
    method : {"auto", "paper"}, WeakForm or StrongForm, optional
        ``"auto"``: weak form, all settings chosen from the record, inertia and damping constant unless a test rejects it, an offset of
        the torque. ``"paper"``: the paper's method: strong form, polynomials in windows of 201 samples, regression windows of 200, all
        parameters windowed, no further terms. A :class:`WeakForm` or :class:`StrongForm` has settings of your own; the defaults of
        parameters and terms are then those of ``"auto"`` (the strong form has no such test: inertia and damping are constant).
        ``"auto"`` always takes the weak form: with the same kinds of parameters its errors were smaller in every case measured, 1.4 to
        55 times for stiffness and 2.8 to 78 times for inertia.
    inertia, damping, stiffness : {"windowed", "constant", "auto", "varying"}, float or array_like, optional
        ``"windowed"``: unknown and time-varying, one value per sample. ``"constant"``: unknown, one value per record. ``"auto"``: constant
        unless a test rejects it (windowed, for stiffness). ``"varying"``: time-varying, but more slowly than windowed parameters (weak
        form; an inertia or a damping that is windowed beside a windowed stiffness is followed so, and what is varying beside nothing
        windowed has windows). A number or an array of the angle's shape: known; 0 leaves it out.
    terms : sequence, optional
        Further terms of the left-hand side, each with an unknown factor: ``"offset"``, ``"coulomb"`` (the sign of the velocity),
        ``"cubic"`` (the cube of the angle), ``"preload"`` (the sign of the angle; negative where the spring has backlash),
        ``"gravity"`` (the sine of the angle), ``"viscous_asymmetric"`` (the magnitude of the velocity), ``"quadratic_drag"`` (the velocity
        times its magnitude), ``"stribeck"`` (exp(-(velocity/Stribeck velocity)²) times the sign of the velocity) or a :class:`Term` of your
        own; or a pair of one of these and its kind. Without a kind a term is windowed if all unknown parameters are, and otherwise
        constant; an offset is ``"auto"`` then in weak form: constant, and free in every window where the record says that it drifts. Beside
        ``"coulomb"`` and ``"stribeck"`` equations that touch samples at rest do not count. The Stribeck velocity, and what a term of your
        own names in ``search=``, is found by a search, which costs 10 to 20 times as much; in a batch every record has its own.
        In weak form, where the record contradicts a constant offset beside a windowed stiffness, the angle at which the spring is relaxed
        is looked for, K (θ - θ₀), and kept where it predicts better: ``constants["angle_zero"]``.
    velocity, acceleration : array_like, the angle's shape, optional
        Channels that were measured too, or instead of the angle: rad/s of a gyroscope or tachometer, rad/s² of an accelerometer. The
        most likely angle is made of all of them, each with the weight that its noise gives it. Their constant biases are in
        ``constants["velocity_bias"]`` and ``constants["acceleration_bias"]``. A channel that is a multiple of the angle's derivative is
        left out, and the advice says so. Without an angle it is the integral of what there is: its zero and its drift are an offset of
        the torque, which is then windowed by default; terms of the angle cannot be told, and beside a spring the mean of the channel
        counts as its bias. An acceleration alone drifts so fast that it tells little of a stiffness.
    instrument : array_like, the angle's shape, optional
        A channel that no noise of angle or torque reaches, but that moves the system: the reference of a controller, or excitation that was
        added. Under feedback noise of the angle is part of the torque, and estimates without an instrument are biased. All unknowns are
        then constant, and estimated by two-stage least squares: the instrument's past explains a motion, and rows of that
        motion multiply those of the recorded one. The summary has a test of exogeneity (Durbin, Wu, Hausman) and says if the instrument
        is weak. Parts of the record, each solved on its own, say whether the unknowns are constant: KIND_CONTRADICTED in
        ``record_status`` and the advice where they are not.
    lag : float, str or "auto", optional
        Delay of the torque in seconds, or with a unit, as in ``"2 ms"``; it may be a fraction of a sample. ``"auto"``, in weak form: the
        lag nearest to zero at which the torque's rate explains nothing more, with its standard error in ``settings["lag_stderr"]``; zero
        if the record does not separate a lag from damping, as with motion at a single frequency. Several records may have one each.
    quantisation : float, optional
        Step to which the angle was rounded, in rad: an encoder's count. It is a lower bound for residuals in strong form, for the noise
        in weak form. By default it is estimated from the samples, as in :func:`tvident.fit_local_polynomials`, but not
        with ``method="paper"``, whose criterion has no such bound. 0 means none.
    mask : array_like of bool, shape (n,) or the angle's, optional
        True where a sample may be the centre of an equation.
    weights : array_like, shape (n,) or the angle's, optional
        Weight of every sample, not negative: one over the variance of the noise of its angle and torque, and of a velocity and an
        acceleration beside the angle, relative to the others. Samples of weight 0 are missing, whatever they hold, and a masked weight is
        0. A factor of all weights changes nothing: noise and residuals are those of a sample of mean weight. With Huber's loss residuals
        are compared times the roots of weights. Where angle and torque have clocks of their own, they are those of the samples of either,
        and say how large the noise of both is at that time; where `align` is to find an offset, those of the angle, and above 0. See Notes.
    loss : {"squares", "huber", "auto"}, optional
        ``"squares"``: least squares. ``"huber"``: residuals of the torque's samples beyond 2.5 standard deviations count linearly, so that
        spikes of few samples move parameters by little, however large they are (Huber 1981, modified residuals): the torque that the
        equation predicts takes the place of such a sample, with 2.5 standard deviations at most, and the record is identified again until
        nothing changes, 3 to 10 times. A touch that lasts as long as the motion is not told from it. ``"auto"``: ``"huber"`` where many
        more residuals are far from zero than of normal noise; ``settings["loss"]`` says what was used.
    period : float, optional
        Period of a wrapped angle in rad, 2π mostly: whole periods are added first so that steps are the shortest that are possible. A
        sample after a step of 0.4 to 0.6 periods, which may go either way, counts as missing. Across a gap the angle goes the shortest
        way or on with the velocity, whichever does better elsewhere in the record. Where both may be wrong by half a period the longest
        part between such gaps is used and the advice says so, unless the equation does not ask how often the angle went round.
    share : str or sequence of str, optional
        What all records of a list (or of a batch) have in common: ``"inertia"``, ``"damping"``, ``"stiffness"``, unknown and constant. It
        is estimated from all of them, each with the weight of its information, and the rest from each with that known, and its error.
        KIND_CONTRADICTED in ``record_status`` says that records differ more than their errors explain (Cochran's test, 1 in 1000).
    dof_axis : int, optional
        The axis of the masses, 0: angle and torque have shape (masses, n), and M q̈ + C q̇ + K q + terms = f is identified. Every entry of
        the matrices is ``"auto"``, unless a parameter is a kind, an :class:`Expansion`, nested lists of these and numbers, or a
        :class:`Matrix`. A row of the
        torque that is NaN was not measured; one that is zero says that no force acts. Returns a :class:`MergedIdentification`.
    structure : Chain or Mechanism, optional
        Springs and dampers between masses, or bodies whose equations follow from their energies, in place of full matrices.
    ensemble_axis : int, optional
        The axis of repeated trials that share I(t), C(t) and K(t), 0: angle and torque have shape (trials, n), or (trials, masses, n)
        with ``dof_axis=1``, or are lists whose lengths may differ. Rows are merged. Returns a :class:`MergedIdentification`.
    phase : array_like or sequence of array_like, as the angle, optional
        Aligns trials: a number that grows from 0 to 1 within each, as through a cycle of gait, in place of the time. The result is that of
        the phase.
    align : {"offset", "drift"}, float or str, optional
        By how much stamps of the torque are late. A number: so many seconds, or ``"2 ms"``. ``"offset"``: it is found from the equation
        itself, wherever within a tenth of the record, and is in ``constants["clock_offset"]`` with its standard error, which those of
        parameters contain. ``"drift"``: the clocks may run at different speeds, too; ``constants["clock_drift"]`` is by how many seconds
        stamps become later each second. Weak form, a single record, angle and torque alone. As a lag, an offset is told from damping only
        where the motion has several frequencies.
    step : int, optional
        Every how many samples a result is wanted.
    nan_policy : {"omit", "propagate", "raise"}, optional
        What to do with values of angle and torque that are not finite. ``"omit"``: only the equations that contain one are removed;
        parameters around it come from the other equations of their window, with the flag GAP. In strong form
        the polynomials of windows that hold short gaps of the angle are fitted on what is there. ``"propagate"``: windowed parameters
        are NaN if their window contains one. ``"raise"``: raise an error.
    settings : mapping, optional
        Settings of an earlier result, as they are or read from JSON: its choices are used again. Other arguments override them, a
        `method` other than ``"auto"`` as a whole. They do not contain `mask`, `weights`, `step`, parameters known at every sample and
        functions of your own terms. A name that no result has is refused.
    workers : int, optional
        Threads; by default ``TVIDENT_WORKERS`` or all processors that this process may use. The numbers do not depend on it.
    progress : bool or callable, optional
        Show a bar, or call a function with the samples done and all of them. An exception that it raises cancels the work.

    Returns
    -------
    Identification, IdentifiedRecords or MergedIdentification
        ``inertia``, ``damping``, ``stiffness``, ``stderr``, ``status``, ``trusted`` and more; ``summary()`` says it in words. For records
        of different lengths, or with `share`, a sequence of these; with `dof_axis` or `ensemble_axis` what masses or trials share.

    Raises
    ------
    ValueError
        If shapes differ, a window does not fit, `t` does not increase, nothing is unknown, the angle spans more than one and a half of
        `period`, a name is unknown, there is no channel of the motion, or something, such as weights, needs the angle where there is none.
    TypeError
        If an array is complex or holds no numbers, or there is no sample period.

    Notes
    -----
    Within 0.2 s inertia and stiffness are nearly collinear unless several frequencies are excited; with a single sine they cannot be
    separated at all. ``condition`` shows this, and ``stderr`` its effect.

    With weights w, an equation has the weight of the noise of its torque: in strong form that of its sample, in weak form, where an
    equation sums 2N + 1 samples times φ, Σφ² / Σ(φ²/w). So weights matter where they differ over stretches longer than the test function:
    among equations that all hold some good and some bad samples there is nothing to choose. Polynomials of the strong form count samples
    alike. That the noise of angle and torque is larger where weights are smaller is taken from you; errors are those of such noise. Where
    samples are brought onto a grid, the variance of its samples lies on straight lines between those of samples that count.

    Standard errors of the strong form follow from the scatter between windows that share no equation: see :class:`Identification`. Those
    of the weak form follow from the covariance of its overlapping rows, which the noise determines, times the cross-validation error
    over the variance of the noise if that is above 1.

    In strong form with unknowns of one kind, the cost is about 60 ns a sample and thread for windows of any length, and memory is
    that of the results, except with terms of your own, which need the derivatives of the whole record. In weak form and with mixed
    kinds it is about 1 to 15 µs a sample, the most if parameters jump, and the equations of the whole record are kept. With `share` every
    record is identified twice, and once more for each that is shared to see what its error does to the rest.

    Where steps of `t` scatter, the period of the grid is their mean, and splines pass through all samples at their own times, of fifth
    order while steps scatter by up to 0.3 of a step. Beyond, that of the orders 1, 3 and 5 is taken whose noise and bias together are
    predicted to be least. The noise of the channels is that of their samples, and standard errors know what splines make of it. Steps much
    longer than the others are gaps, whose samples are missing; so are steps over which splines do not predict samples that are left out
    elsewhere. Where a clock is uniform but lost samples, one or two in a row are bridged by splines of the order that misses samples left
    out least, unless that adds more to the variance of the equations than is lost without them. So are missing values in weak form with
    ``nan_policy="omit"``, in every channel its own, where short gaps would take more than a tenth of the equations. Where a channel is
    smooth in sample number and not in time, the stamps jitter and not the samples, as behind a buffer: then samples are taken to be even,
    and the advice says so, with CHANNEL_SUSPECTED. Where angle and torque have clocks of their own, both are brought onto a grid at the
    rate of the faster, so that every sample of both counts, and single missing samples are bridged; in strong form, and with an
    :class:`Expansion`, onto the clock of the angle. Results are at the times of the grid, ``time``. All this costs about 1 µs a sample.

    See Also
    --------
    WeakForm, StrongForm : settings of the two forms.
    fit_local_polynomials : the derivatives that the strong form takes.
    rolling_least_squares : least squares in windows alone.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    P. J. Huber: Robust statistics, Wiley 1981.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> t = np.arange(4000) / 1000
    >>> angle = 0.2 * np.sin(2 * np.pi * 2 * t) + 0.1 * np.sin(2 * np.pi * 7 * t)
    >>> velocity, acceleration = np.gradient(angle, t), np.gradient(np.gradient(angle, t), t)
    >>> torque = 0.01 * acceleration + 0.05 * velocity + 15 * angle
    >>> result = tvident.identify(angle, torque, sample_rate=1000)
    >>> bool(abs(result.stiffness[2000] - 15) < 0.01)
    True
    >>> paper = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    >>> bool(abs(paper.stiffness[2000] - 15) < 0.01)
    True
    """
    call = {name: value for name, value in locals().items() if name != "share"}
    together = Options.of({**call, "share": share})
    if together.is_asked:
        return identify_together(angle, torque, together)
    records = calls_of_records(call, names := names_shared(share))
    if records is not None:
        return identify_records(identify, records, names, progress)
    return prepared(call).run(progress)
