"""Derivatives of noisy samples: local polynomials of an order chosen in every window."""

from __future__ import annotations

from functools import partial
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._choices import Criterion, Loss, Selection
from tvident._derivatives.automatic import choose
from tvident._derivatives.automatic_gaps import choose_beside_gaps
from tvident._derivatives.fit import LocalPolynomialFit, Sampled, unit_of_samples
from tvident._derivatives.found import Found
from tvident._derivatives.incomplete import (
    check_weighted,
    filled,
    gaps_given,
    left_out,
    longest_gap,
    weights_along,
)
from tvident._derivatives.own_times import at_own_times, left_out_of_own_times, period_or_times
from tvident._derivatives.plans import HIGHEST_ORDER, SHORTEST_WINDOW, plan, quantisation_step
from tvident._derivatives.robust import robust, value_in
from tvident._tables import shaped


# All but the data are options, as users call it.
@arguments.called_as("fit_local_polynomials(y, 201, sample_rate=1000)")
def fit_local_polynomials(
    y: npt.ArrayLike,
    window_length: int | str,
    *,
    delta: float | None = None,
    sample_rate: float | None = None,
    t: npt.ArrayLike | None = None,
    max_order: int = HIGHEST_ORDER,
    order: int | None = None,
    criterion: Criterion = "aicc",
    selection: Selection = "window",
    loss: Loss = "squares",
    max_deriv: int = 2,
    axis: int = -1,
    step: int = 1,
    weights: npt.ArrayLike | None = None,
    period: float | None = None,
    nan_policy: arguments.RowPolicy = "propagate",
    max_gap: int | str | None = None,
    min_observations: int | None = None,
    quantisation: float | None = None,
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> LocalPolynomialFit:
    r"""Differentiate noisy samples with a polynomial order chosen in every window.

    Around every sample :math:`t_i` a polynomial :math:`\sum_{j \le n} \alpha_j (t - t_i)^j` is fitted to the window of ``M`` samples by
    least squares (equation (2) of the paper) for every order ``n``, and the order that minimises the corrected Akaike information criterion

    .. math:: AICc_n = M \ln σ_n^2 + 2K + \frac{2K(K+1)}{M-K-1}, \quad K = n + 1, \quad σ_n^2 = RSS_n / (M - 1)

    (equations (8) and (9)) gives the value and its derivatives.

    Parameters
    ----------
    y : array_like
        Samples: real numbers of any type, any shape. Masked ones are missing, as NaN is. A table (pandas, polars, a structured array)
        has time along its rows.
    window_length : int or str
        Samples in a window, ``M = 2N + 1``: odd, at least 5; or a duration such as ``"0.2 s"``, of which the nearest odd number of
        samples is taken; or ``"auto"``: window and order are chosen together, for every derivative on its own (see Notes).
    delta : float, optional
        Sample period in seconds; by default that of an index of dates if `y` has one, and 1 otherwise. Give at most one of `delta`,
        `sample_rate` and `t`.
    sample_rate : float, optional
        Samples per second.
    t : array_like, optional
        Time of every sample, shape (n,): seconds, dates or durations, which increase. Where they are not uniform to a thousandth of the
        sample period, or within the digits that they were printed with, every window is fitted at the true times of its samples.
    max_order : int, optional
        Highest candidate order, at most 15. Orders that are too high for a short window are left out.
    order : int, optional
        Fixes the order: the classic Savitzky–Golay filter, with noise and errors.
    criterion : {"aicc", "aicc-textbook", "aic", "bic"}, optional
        What is minimised. ``"aicc"`` counts parameters as the paper does; ``"aicc-textbook"`` counts the noise variance too.
    selection : {"window", "pooled", "average"}, optional
        ``"window"``: every window has the order with the smallest criterion in it, as in the paper. ``"pooled"``: the criterion is summed
        over the neighbouring windows, those that share a sample with the window, and the sum chooses the order. ``"average"``: the
        estimates of all orders are averaged with Akaike weights :math:`w_n ∝ \exp(-AICc_n/2)`.
    loss : {"squares", "huber"}, optional
        ``"huber"``: residuals of the value beyond 1.345 standard deviations count linearly, so that spikes move estimates by little,
        however large they are (Huber 1981, modified residuals); with `weights` these are standard deviations of each sample's own. Some
        10 to 40 fits are made.
    max_deriv : int, optional
        Highest derivative wanted, at most 15.
    axis : int, optional
        Axis of time; where it is left out, the dimension of xarray that is called ``time`` or has dates.
    step : int, optional
        Every how many samples an estimate is wanted: the same numbers as ``[::step]`` of all of them, to rounding. From a tenth of
        a window on each window is projected by itself and the cost is that of the windows that are wanted; below, where `t` is uniform,
        the bits are the same.
    weights : array_like, shape (n,) or that of `y`, optional
        Weight of every sample, not negative: one over the variance of its noise, relative to the others. A sample of weight 0 is left out,
        whatever it holds. ``sigma`` is then that of a sample of weight 1. Every window is fitted on its own, as those beside gaps are.
    period : float, optional
        Period of a wrapped angle in the unit of `y`: 2π or 360. Whole periods are added first so that steps are the shortest that are
        possible. A sample after a step of 0.4 to 0.6 periods, which may go either way, counts as missing. ``settings["splits"]`` lists the
        samples after gaps that do not say how often the angle went round in them: there the value, not its derivatives, may be
        wrong by whole periods.
    nan_policy : {"propagate", "omit", "raise"}, optional
        ``"propagate"``: windows that contain a value that is not finite are NaN, and no others. ``"omit"``: they are fitted on what is
        there (status GAP), each with an order of its own, and estimates go on across short gaps; all other windows keep their bits.
        Where `t` is not uniform windows are made of the samples that are there, also of those with a weight, and at the others there is
        no estimate. ``"raise"``: raise an error.
    max_gap : int or str, optional
        With ``"omit"`` or weights: samples, or a duration. Longer gaps split the record: nothing is estimated in them, and windows end
        there as at the ends of a record. By default half a window. Where `t` is not uniform a gap is a step of time, so many usual steps
        (their median) longer than one of them, whether samples are missing there or not; by default none splits the record.
    min_observations : int, optional
        Samples that a window must hold with ``"omit"`` or weights, at least 3; by default half a window, and 5 in windows of a duration
        where `t` is not uniform.
    quantisation : float, optional
        Step to which `y` was rounded, in its unit: an encoder's count, a converter's last bit. By default it is estimated from
        the samples: the step of which all differences of neighbours are multiples, the smallest one of all records. 0 means none.
    workers : int, optional
        Threads; by default ``TVIDENT_WORKERS`` or all processors that this process may use. The numbers do not depend on it.
    progress : bool or callable, optional
        Show a bar, or call a function with the samples done and all of them. An exception that it raises cancels the work.

    Returns
    -------
    LocalPolynomialFit
        ``derivatives`` of shape (max_deriv + 1, \*y.shape) in the unit of `y` per second to the power of the derivative, ``order``,
        ``sigma``, ``status``, ``stderr``, ``window_length``, ``settings`` and ``scores(i)``.

    Raises
    ------
    ValueError
        If the window is even, shorter than 5 samples or longer than the record, if an order is too high, if `t` does not increase, if
        `y` spans more than one and a half of `period`, or if a name is unknown. With ``"auto"``, if the record has fewer than 64
        samples, if no order reaches `max_deriv`, or if `criterion` or `selection` is given. With `weights`, if orders are pooled or
        averaged; with `weights` or `min_observations`, and with Huber's loss where `t` is not uniform, if the window is ``"auto"``.
        Where `t` is not uniform, if orders are pooled or averaged, or with `max_gap` if the window is ``"auto"``.
    TypeError
        If `y` is complex or holds no numbers, or a number is not whole.

    Notes
    -----
    No residual is taken to be smaller than what rounding to a step ``q`` leaves on average, :math:`RSS_n \ge M q^2/12`, nor than the
    rounding of the arithmetic. So a resting encoder has order 0, and its status says EXACT.

    The first and last ``N`` samples are evaluated off the centre of the first and last full window, where noise is amplified more. Each
    derivative takes there the order with the least estimated squared bias plus variance, at most ``order``; the status says EDGE.

    The order that is best in one window also depends on the noise in it. On the simulated rig at 40 and 20 dB, with windows of 101
    samples, the error of the second derivative is 1.9 and 3.2 times that with the one order that is best for all windows; with
    ``"average"`` 1.6 and 2.7 times, with ``"pooled"`` 1.0 and 1.1 times.

    With ``window_length="auto"`` every derivative has a window and an order of its own: those with the least estimated mean squared
    error :math:`b^2 + k^T Γ k` over the record, ``b`` the bias, ``k`` the weights of the samples and ``Γ`` the covariance of the noise,
    white, coloured or low-passed, which is found in records of 800 samples and more. The candidates near them
    are weighted again in every neighbourhood of five half-widths, so that estimates follow a signal that changes. Near the ends
    coefficients are shrunk towards what other windows predict. The error of θ̈ of the simulated rig is within 3 % of that of the best
    window and order known afterwards, and 20 to 30 % below it if the signal is a chirp. Windows that contain a value that is not finite
    are left out; samples that no candidate's window reaches are NaN. With ``nan_policy="omit"`` windows are chosen with the missing samples
    bridged where their neighbours tell them as well as samples would, and estimates within a window of a missing one are made as below, in
    the best windows: on sums of sines with 1, 5 and 30 % of the samples missing at random the errors are 1.0 to 1.1, 1.0 to 1.2 and mostly
    1.2 to 1.8 (one of 36 records: 2.8) times those without a gap, and nominal 95 % intervals of the second derivative cover 66 to 90 %.
    It takes two to five times as long where few windows hold a gap, and up to 40 times where nearly all do, as with 1 % missing at random
    and windows of 800 samples for a slow motion: each takes some 4 µs then, of those at every `step`-th sample.

    With ``nan_policy="omit"`` a window that lacks samples is fitted by polynomials that are orthogonal on the others, and each derivative
    takes the order with the least estimated squared bias plus variance, since such a window is not symmetric. Its standard errors are those
    of that order with the bias; that the order was chosen is not in them, so that nominal 95 % intervals cover 80 to 95 %. A derivative
    above the order is zero and has no standard error (NaN). This costs some 1.4 µs a window of 201 samples and thread.

    Where `t` is not uniform every window has a design of its own, and derivatives are those at each sample's own time. A duration takes
    the samples that lie in it, however many; windows with fewer than 5 are NaN. ``"auto"`` chooses window and order of every derivative
    from the samples as splines bring them onto a uniform grid, and takes the window's duration, or its number of samples where fewer lie
    in that than the order needs; steps longer than half of it split the record. On sums of sines with noise whose steps scatter by up to
    1.4 of a step (the most is 1.5) the error is 0.1 to 1.4 times that with the best of six windows. Standard errors are those of the
    order without its bias: nominal 95 % intervals cover 84 to 96 %. ``"pooled"`` and ``"average"`` need uniform times. A window of
    51 to 2001 samples takes 0.15 to 0.8 µs with AVX2, where `step` is far below its length and at most five derivatives are asked for:
    neighbours share one basis. Standard errors take 0.2 to 0.9 µs, when they are asked for. At the ends, near gaps and outliers each is
    fitted on its own, in some 1.4 µs with 201 samples, as all are where weights differ.

    The cost is about 15 ns a sample and thread for any window length on a processor with AVX-512, about twice that with AVX2; averaged
    about twice as much; pooled about 300 ns, because the orders of every window need logarithms; ``"auto"`` about 5 µs a sample and
    derivative in short records and 0.5 to 1.5 µs in those of a million samples.

    See Also
    --------
    savgol_filter : a filter of fixed order, with SciPy's call.
    identify : parameters of the equation of motion, from these derivatives or without any.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    K. P. Burnham, D. R. Anderson: Model Selection and Multimodel Inference, 2002.
    P. J. Huber: Robust statistics, Wiley 1981.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> t = np.arange(2000) / 1000
    >>> y = np.sin(2 * np.pi * 3 * t) + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    >>> fit = tvident.fit_local_polynomials(y, 201, sample_rate=1000)
    >>> fit.derivatives.shape
    (3, 2000)
    >>> error = fit.derivatives[2] + (2 * np.pi * 3) ** 2 * np.sin(2 * np.pi * 3 * t)
    >>> bool(np.sqrt(np.mean(error[100:-100] ** 2)) < 0.01 * (2 * np.pi * 3) ** 2)
    True
    >>> automatic = tvident.fit_local_polynomials(y, "auto", sample_rate=1000)
    >>> automatic.window_length.shape
    (3,)
    >>> error = automatic.derivatives[2] + (2 * np.pi * 3) ** 2 * np.sin(2 * np.pi * 3 * t)
    >>> bool(np.sqrt(np.mean(error**2)) < 0.001 * (2 * np.pi * 3) ** 2)
    True
    """
    given = shaped("y", y, axis)
    array, axis = given.array, given.axis
    samples = arguments.along_axis("y", array, axis)
    count = samples.shape[-1]
    t, seconds, times = period_or_times(y, samples, delta=delta, sample_rate=sample_rate, t=t)
    arguments.one_of("criterion", criterion, get_args(Criterion))
    arguments.one_of("selection", selection, get_args(Selection))
    weighed = None if weights is None else weights_along(weights, array.shape, axis)
    arguments.check_nan(
        "y", array if weighed is None else np.where(weighed > 0, samples, 0), nan_policy, arguments.RowPolicy
    )
    max_order = arguments.whole_number("max_order", max_order, least=0, most=HIGHEST_ORDER)
    order = None if order is None else arguments.whole_number("order", order, least=0, most=HIGHEST_ORDER)
    # Derivatives above the highest order are zero.
    max_deriv = arguments.whole_number("max_deriv", max_deriv, least=0, most=HIGHEST_ORDER)
    arguments.check_power("max_deriv", max_deriv, seconds)
    every, threads = arguments.whole_number("step", step, least=1), arguments.worker_count(workers)
    # Whole periods need not be multiples of the step.
    step_of_rounding = quantisation_step(samples, quantisation)
    turned = None if period is None else arguments.unwrapped("y", samples, period)
    samples = samples if turned is None else turned.values
    is_timed = any(one is not None for one in (delta, sample_rate, t))
    sampled = Sampled(
        every, seconds, arguments.begin_of(t), arguments.labels_of(y), times, unit_of_samples(y, is_timed=is_timed)
    )
    automatic = isinstance(window_length, str) and window_length.strip() == "auto"
    if automatic:
        _check_left_to_the_rule(criterion, selection)

    def plan_of_window(length: int, highest: int = max_order, derivative: int = max_deriv) -> _core.LocalPolynomials:
        return plan(
            length,
            order=order,
            max_order=highest,
            criterion=criterion,
            selection=selection,
            derivatives=tuple(range(derivative + 1)),
            delta=seconds,
            noise=True,
            quantisation=step_of_rounding,
        )

    choose_automatically = partial(
        choose, plan_of_window=plan_of_window, max_order=max_order, order=order, workers=threads
    )
    if times is not None:
        left = left_out_of_own_times(
            nan_policy,
            weighed,
            max_gap,
            min_observations,
            window_length=window_length,
            selection=selection,
        )
        found = at_own_times(
            samples,
            times,
            window_length,
            choose_on=partial(choose_automatically, max_deriv=max_deriv, quantisation=None, step=1, progress=None),
            order=order,
            max_order=max_order,
            criterion=criterion,
            max_deriv=max_deriv,
            loss=arguments.one_of("loss", loss, get_args(Loss)),
            left=left,
            quantisation=step_of_rounding,
            step=every,
            workers=threads,
            progress=progress,
        )
        found.settings.update(_of_wrapped(turned, period))
        return LocalPolynomialFit(samples, axis, found, sampled)
    length = 0 if automatic else _window(window_length, seconds, count)
    choose_automatically = partial(
        choose_automatically,
        delta=seconds,
        quantisation=None if quantisation is None and turned is None else step_of_rounding,
    )
    beside_gaps = automatic and nan_policy == "omit" and weights is None and min_observations is None
    if beside_gaps:
        choose_automatically = partial(
            choose_beside_gaps, choose_automatically, plan_of_window, longest_gap(max_gap, seconds), workers=threads
        )
    incomplete = (
        None
        if beside_gaps
        else gaps_given(
            nan_policy,
            max_gap,
            min_observations,
            weighted=weighed is not None,
            weights=weighed,
            length=length,
            period=seconds,
        )
    )
    if incomplete is not None:
        check_weighted(automatic=automatic, weighted=weighed is not None, selection=selection)
    if arguments.one_of("loss", loss, get_args(Loss)) == "huber":
        without = partial(left_out, longest_gap=longest_gap(max_gap, seconds)) if beside_gaps else lambda _: incomplete
        samples = robust(
            samples,
            choose_automatically if automatic else None,
            value_in(plan_of_window, without, threads),
            length,
            omit=nan_policy == "omit",
            weights=weighed,
        )
    with arguments.reporter(progress, "local polynomials") as report:
        if automatic:
            found = choose_automatically(samples, max_deriv=max_deriv, step=every, progress=report)
            found.settings["loss"] = loss
            found.settings.update(_of_wrapped(turned, period))
            return LocalPolynomialFit(samples, axis, found, sampled)
        core_plan = plan_of_window(length)
        whole = samples if incomplete is None else incomplete.plain(samples)
        estimates = core_plan.estimate(whole, step=every, workers=threads, progress=report)
        completed = (
            None
            if incomplete is None
            else filled(core_plan, estimates, samples, incomplete, step=every, workers=threads)
        )
    found = Found(
        derivatives=estimates.derivatives,
        order=estimates.order,
        status=estimates.status,
        sigma=estimates.sigma,
        window_length=length,
        settings={
            "window_length": length,
            "order": order,
            "max_order": max_order,
            "criterion": criterion,
            "selection": selection,
            "loss": loss,
            "quantisation": step_of_rounding,
            **_of_wrapped(turned, period),
        },
        errors=completed.errors if completed else lambda: core_plan.errors(samples, step=every, workers=threads),
        plan_of=lambda _: core_plan,
    )
    return LocalPolynomialFit(samples, axis, found, sampled)


def _window(window_length: int | str, seconds: float, count: int) -> int:
    """Return the samples of a window."""
    length = arguments.window_length("window_length", window_length, seconds, odd=True)
    arguments.check_window("window_length", length, count, least=SHORTEST_WINDOW)
    return length


def _of_wrapped(turned: arguments.Unwrapped | None, period: float | None) -> dict[str, Any]:
    """Return what is to be said of a wrapped angle."""
    if turned is None:
        return {}
    return {"period": float(period or 0.0), "splits": turned.splits if len(turned.splits) > 1 else turned.splits[0]}


def _check_left_to_the_rule(criterion: str, selection: str) -> None:
    """Check that nothing is asked for that belongs to a window of given length."""
    for name, value, default in (("criterion", criterion, "aicc"), ("selection", selection, "window")):
        if value != default:
            raise ValueError(
                f"{name} chooses the order in a window that is given; got {arguments.shown(value)} with window_length='auto', which "
                f"chooses the order too; leave {name} out or give a window"
            )


def rates_of_channel(
    period: float, channel: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the first and the second derivative of a channel by time, with windows that are chosen; NaN where it is missing."""
    _, first, second = fit_local_polynomials(channel, "auto", delta=period).derivatives[:3]
    return first, second
