"""The result of fitting local polynomials."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._derivatives.found import Found
from tvident._tables import Table, Tabular
from tvident._units import derivative_units, unit_named, unit_said


@dataclass(frozen=True)
class Sampled:
    """How a signal was sampled.

    Parameters
    ----------
    step : int
        Every how many samples there is a result.
    period, start : float
        Seconds from sample to sample, and of the first.
    labels : Labels, optional
        Those of the container that the samples came in.
    times : ndarray, optional
        Time of every sample in seconds where the period does not tell it.
    unit : str
        Of the samples; empty if it, or the unit of time, is not known.
    """

    step: int = 1
    period: float = 1.0
    start: float = 0.0
    labels: arguments.Labels | None = None
    times: npt.NDArray[np.float64] | None = None
    unit: str = ""

    def at(self, samples: int) -> npt.NDArray[np.float64]:
        """Return the time of every result of so many samples in seconds."""
        if self.times is not None:
            return self.times[:: self.step]
        return self.start + np.arange(0, samples, self.step, dtype=np.float64) * self.period


def unit_of_samples(samples: Any, *, is_timed: bool) -> str:
    """Return the unit that samples or their name say, which derivatives by seconds have, too; empty if time is counted in samples."""
    return unit_said(samples) or unit_named(samples) if is_timed else ""


class LocalPolynomialFit(Tabular):
    r"""What :func:`fit_local_polynomials` found.

    Attributes
    ----------
    derivatives : ndarray of float64, shape (max_deriv + 1, \*y.shape)
        Value, first, second, … derivative, in the unit of ``y`` per second to the power of the derivative.
    order : ndarray of uint8, shape y.shape
        Order chosen in the window around each sample; if orders were averaged, the one with the largest weight; if windows were chosen,
        that of the highest derivative. Near the ends each derivative may take a lower one (see Notes of
        :func:`fit_local_polynomials`).
    sigma : ndarray of float64, shape y.shape
        Standard deviation of the noise in each window, in the unit of ``y``: the root of RSS/(M - n - 1). Where windows were chosen, that
        of the record, also of noise that is correlated from sample to sample.
    status : ndarray of uint16, shape y.shape
        Flags of :class:`tvident.Status`, 0 is good.
    window_length : int, str or ndarray of int
        Samples in a window, or a duration where `t` is not uniform and one was given. Where they were chosen, those that suit each record
        best, one number a derivative: shape (max_deriv + 1, \*y.shape without the axis).
    settings : dict
        What was used and what was chosen: ``window_length``, ``order``, ``max_order``, ``quantisation``, and either ``criterion`` and
        ``selection`` or ``noise``, the standard deviation of each record's noise.

    See Also
    --------
    fit_local_polynomials : returns it.
    Status : what the flags mean.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    K. P. Burnham, D. R. Anderson: Model Selection and Multimodel Inference, 2002: standard errors of a chosen order.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> t = np.arange(1000) / 1000
    >>> fit = tvident.fit_local_polynomials(np.sin(20 * t), 101, sample_rate=1000)
    >>> value, velocity, acceleration = fit.derivatives
    >>> bool(abs(velocity[500] - 20 * np.cos(20 * t[500])) < 1e-6)
    True
    """

    def __init__(
        self,
        samples: npt.NDArray[Any],
        axis: int,
        found: Found,
        sampled: Sampled,
    ) -> None:
        self._samples = samples
        self._axis = axis % samples.ndim
        self._sampled = sampled
        self._found: Found | None = found
        self.derivatives: npt.NDArray[np.float64] = self._in_place(found.derivatives)
        self.order: npt.NDArray[np.uint8] = self._in_place(found.order)
        self.status: npt.NDArray[np.uint16] = self._in_place(found.status)
        self.sigma: npt.NDArray[np.float64] = self._in_place(found.sigma)
        self.window_length: int | str | npt.NDArray[np.intp] = found.window_length
        self.settings: dict[str, Any] = found.settings

    @property
    def time(self) -> npt.NDArray[np.float64]:
        """Time of every result in seconds, along the axis of time, shape (n,).

        See Also
        --------
        derivatives : the results.
        """
        return self._sampled.at(self._samples.shape[-1])

    def _in_place(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Put the axis of the samples, last so far, where the user has it."""
        place = self._axis - self._samples.ndim
        return array if place == -1 else np.moveaxis(array, -1, place)

    @cached_property
    def stderr(self) -> npt.NDArray[np.float64]:
        r"""Standard errors: ndarray of float64 in the shape and units of ``derivatives``; computed when first asked for.

        If the order is fixed they are ``sigma`` times the gain of the filter, :math:`g_n = \sqrt{\sum_{j \le n} q_j^{(d)}(x)^2}/Δ^d`,
        without the bias of the polynomial. If it was chosen, or averaged, they contain the uncertainty of this choice:
        :math:`\sum_n w_n \sqrt{σ_n^2 g_n^2 + (d_n - \hat d)^2}` around the estimate (Burnham and Anderson 2002, section 4.3.2), with the
        Akaike weights of the window's criterion; for ``selection="pooled"`` those of the neighbours' mean, which is worth 2.4 windows.
        On the simulated rig the coverage of nominal 95 % intervals is 92 to 97 %; with ``sigma`` times gain alone it would be 70 to 95 %.
        If windows were chosen they contain the variance between all candidates and the bias estimated around each sample. Within half a
        window of the ends they are those of the order that was taken there.

        The cost is about 300 ns a sample; that of the fit if the order is fixed, and somewhat more where `t` is not uniform; nothing if
        windows were chosen.

        See Also
        --------
        sigma : the noise that it follows from.
        scores : the criterion behind the weights.

        References
        ----------
        K. P. Burnham, D. R. Anderson: Model selection and multimodel inference (2002), section 4.3.2; equation (d) of docs/mathematics.md.

        Examples
        --------
        >>> import numpy as np
        >>> import tvident
        >>> noise = np.random.default_rng(0).standard_normal(1000)
        >>> fit = tvident.fit_local_polynomials(noise, 101, order=0, max_deriv=0)
        >>> np.round(fit.stderr[0, 500] * np.sqrt(101) / fit.sigma[500], 6)
        np.float64(1.0)
        """
        assert self._found is not None  # noqa: S101 - what is stored has its errors
        return self._in_place(self._found.errors())

    def scores(self, i: int) -> npt.NDArray[np.float64]:
        r"""Return the criterion of every candidate order in the window around sample ``i``: equation (8) of the paper.

        Parameters
        ----------
        i : int
            Sample number along the axis of time; negative numbers count from the end. Near an end this is the first or last full
            window.

        Returns
        -------
        ndarray of float64, shape (orders, \*y.shape without the axis)
            Infinite for orders that are no candidates; NaN where the window holds a value that is no number.

        Raises
        ------
        IndexError
            If there is no such sample.
        TypeError
            If `i` is not a whole number.
        ValueError
            If the fit was stored: pickling keeps no plan of its windows.

        See Also
        --------
        order : the order that was taken.
        fit_local_polynomials : `criterion=` chooses it.

        Notes
        -----
        The cost is that of projecting one window: O(window · orders).

        References
        ----------
        C. M. Hurvich, C.-L. Tsai: Regression and time series model selection in small samples, Biometrika 76 (1989).

        Examples
        --------
        >>> import numpy as np
        >>> import tvident
        >>> t = np.arange(1000) / 1000
        >>> y = t**3 + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
        >>> scores = tvident.fit_local_polynomials(y, 601, sample_rate=1000).scores(500)
        >>> scores.shape, int(scores.argmin())
        ((16,), 3)
        """
        samples = self._samples.shape[-1]
        place = arguments.whole_number("i", i)
        if not -samples <= place < samples:
            raise IndexError(f"i must be a sample number below {samples}; got {place}; count from 0")
        found = self._found
        if found is None:
            raise ValueError(
                "scores must be asked of a fit that was not stored; got one that was pickled; fit the samples again"
            )
        leading = self._samples.shape[:-1]
        columns = [found.plan_of(index).scores(self._samples[index], place % samples) for index in np.ndindex(leading)]
        # Windows of different lengths may have different numbers of candidates.
        scores = np.full((max(map(len, columns), default=0), len(columns)), np.inf)
        for column, values in enumerate(columns):
            scores[: len(values), column] = values
        return scores.reshape(-1, *leading)

    def __getstate__(self) -> dict[str, Any]:
        # Errors are computed when they are asked for, by what cannot be stored.
        return self.__dict__ | {"stderr": self.stderr, "_found": None}

    def _table(self) -> Table:
        sampled = self._sampled
        last = self._axis - self._samples.ndim
        values, errors = (np.moveaxis(each, last, -1) for each in (self.derivatives, self.stderr))
        columns: dict[str, npt.NDArray[Any]] = {}
        for place, (value, error) in enumerate(zip(values, errors, strict=True)):
            name = f"derivative_{place}" if place else "value"
            columns |= {name: value, f"{name}_stderr": error}
        rest: dict[str, npt.NDArray[Any]] = {"sigma": self.sigma, "order": self.order, "status": self.status}
        columns |= {name: np.moveaxis(each, last, -1) for name, each in rest.items()}
        every, labels = sampled.step, sampled.labels
        units = derivative_units(sampled.unit, len(values))
        names = ["value", *(f"derivative_{place}" for place in range(1, len(values)))]
        return Table(
            time=self.time,
            columns=columns,
            units=dict(zip(names, units, strict=True)) | {"sigma": sampled.unit} if sampled.unit else {},
            settings=json.loads(json.dumps(self.settings, default=np.ndarray.tolist)),
            labels=None if labels is None else labels.at(slice(None, None, every)),
        )

    def __repr__(self) -> str:
        orders = f"orders {self.order.min()}…{self.order.max()}" if self.order.size else "no samples"
        windows = ", ".join(str(length) for length in np.unique(self.window_length))
        return f"<LocalPolynomialFit of {self._samples.shape[-1]} samples, windows of {windows}, {orders}>"
