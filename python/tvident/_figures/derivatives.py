"""A picture of a channel and its derivatives."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident._derivatives import LocalPolynomialFit
from tvident._figures.style import INK, draw_parameter, style


def plot_derivatives(time: npt.NDArray[np.float64], fit: LocalPolynomialFit, name: str = "y") -> Figure:
    """Draw a channel and its derivatives over time, with bands of two standard errors, and the order chosen.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds.
    fit : LocalPolynomialFit
        Of a single record.
    name : str, optional
        What the channel is called.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there are several records.

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
    >>> figures.plot_derivatives(rig.time, fit, "angle").savefig("derivatives.png")
    """
    if fit.order.ndim != 1:
        raise ValueError(f"only a single record can be drawn; this one has shape {fit.order.shape}; take one record")
    count = fit.derivatives.shape[0]
    name = name.replace("$", r"\$")  # no formula
    with style():
        figure = plt.figure(figsize=(8, 1.4 + 1.6 * count), layout="constrained")
        axes = figure.subplots(count + 1, 1, sharex=True)
        for d, ax in enumerate(axes[:-1]):
            draw_parameter(ax, time, fit.derivatives[d], fit.stderr[d])
            ax.set_title(name if d == 0 else f"{name}: derivative {d}")
        axes[-1].plot(time, fit.order, ".", color=INK, markersize=1.5)
        axes[-1].set_title("Order")
        axes[-1].yaxis.set_major_locator(MaxNLocator(integer=True))
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels()
        return figure
