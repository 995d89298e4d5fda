"""A picture of a channel and its derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident import _arguments as arguments
from tvident._derivatives import LocalPolynomialFit
from tvident._figures.style import INK, MUTED, Place, draw_parameter, legend, panels, plain, scale, style
from tvident._units import derivative_units, unit_said

_MOST_DOTS = 20_000


def plot_derivatives(
    time: npt.NDArray[np.float64],
    fit: LocalPolynomialFit,
    name: str = "y",
    *,
    samples: npt.ArrayLike | None = None,
    unit: str = "",
    ax: Place = None,
) -> Figure:
    """Draw a channel and its derivatives over time, with bands of two standard errors, and the order chosen.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds.
    fit : LocalPolynomialFit
        Of a single record.
    name : str, optional
        What the channel is called.
    samples : array_like, shape (n,), optional
        The raw samples, which are drawn as dots below the smoothed channel.
    unit : str, optional
        Of the samples, for the axes: that of derivatives has seconds, too. By default that of `samples`, if they know it.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided into panels. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there are several records, or not as many samples as times.

    See Also
    --------
    fit_local_polynomials : differentiates a channel.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Equations (2) and (8): the polynomials whose derivatives are drawn.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> fit = tvident.fit_local_polynomials(rig.angle, 201, sample_rate=1000)
    >>> figures.plot_derivatives(rig.time, fit, "angle", samples=rig.angle).savefig("derivatives.png")
    """
    if fit.order.ndim != 1:
        raise ValueError(f"only a single record can be drawn; this one has shape {fit.order.shape}; take one record")
    count = fit.derivatives.shape[0]
    arguments.check_in_memory("samples", samples)
    raw = None if samples is None else np.asarray(samples, np.float64)
    if raw is not None and raw.shape != time.shape:
        raise ValueError(
            f"samples must be as many as times; got shape {raw.shape} for {time.size} times; take every step-th"
        )
    units = derivative_units(unit or unit_said(samples), count)
    name = plain(name)
    with style():
        figure, axes = panels(ax, [1.7] * count + [1.2], width=8.0)
        for d, panel in enumerate(axes[:-1]):
            if d == 0 and raw is not None:
                every = max(1, raw.size // _MOST_DOTS)
                dots: Any = {"color": MUTED, "markersize": 2.5, "alpha": 0.45, "markeredgewidth": 0, "label": "samples"}
                panel.plot(time[::every], raw[::every], ".", **dots)
            draw_parameter(panel, time, fit.derivatives[d], fit.stderr[d], label="fitted")
            panel.set_title(name if d == 0 else f"{name}: derivative {d}")
            panel.set_ylabel(plain(units[d].replace("^2", "²").replace("^3", "³")))
        if raw is not None:
            scale(axes[0], raw, fit.derivatives[0])
        legend(axes[0], ax)
        axes[-1].plot(time, fit.order, ".", color=INK, markersize=1.5, rasterized=True)
        axes[-1].set_title("Order")
        axes[-1].yaxis.set_major_locator(MaxNLocator(integer=True, nbins=4))
        axes[-1].set_xlabel("time (s)")
        if ax is None:
            figure.align_ylabels()
        return figure
