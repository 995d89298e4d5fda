"""A picture of order and status over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident._figures.parameters import DrawableResult, check_single, flagged_everywhere
from tvident._figures.style import FOUND, TRUTH, Place, panels, style
from tvident._status import DOUBTFUL, Status, stretches_of

_MOST_STRETCHES = 2000
"""Of a flag that are drawn one by one; more are drawn as they look: joined where they are closer than a line is wide."""


def plot_status(result: DrawableResult, ax: Place = None) -> Figure:
    """Draw where each flag of the status is set, and the order of the polynomials where there are any.

    Flags of samples that are not to be trusted are vermilion, others blue; what holds for the whole record is named below.

    Parameters
    ----------
    result : Identification
        Of a single record.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided if there are orders. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records.

    See Also
    --------
    Status : what the flags mean.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    The choice of the order, equation (15).

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    >>> figures.plot_status(result).savefig("status.png")
    """
    check_single(result)
    occurring = int(np.bitwise_or.reduce(result.status)) if result.status.size else 0
    flags = [flag for flag in Status if occurring & flag]
    has_orders = bool(result.order.any())
    heights = ([1.7] if has_orders else []) + [0.5 + 0.28 * max(1, len(flags))]
    period = float(result.settings["step"]) / float(result.settings["sample_rate"])
    with style():
        figure, axes = panels(ax, heights)
        if has_orders:
            axes[0].plot(result.time, result.order, ".", color=FOUND, markersize=1.5, rasterized=True)
            axes[0].set_title("Order of the polynomial")
            axes[0].yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
        panel = axes[-1]
        for row, flag in enumerate(flags):
            first, end = stretches_of(result.status & flag != 0)
            begins, ends = result.time[first], result.time[end - 1] + period
            if begins.size > _MOST_STRETCHES:
                gap = (result.time[-1] - result.time[0]) / _MOST_STRETCHES
                apart = np.flatnonzero(begins[1:] - ends[:-1] > gap)
                begins, ends = begins[np.append(0, apart + 1)], ends[np.append(apart, ends.size - 1)]
            colour = TRUTH if flag & DOUBTFUL else FOUND
            panel.broken_barh(
                list(zip(begins, ends - begins, strict=True)), (row - 0.32, 0.64), color=colour, linewidth=0.8
            )
        share = float(np.mean(result.status == 0)) if result.status.size else 0.0
        panel.set_title(f"Status: {share:.1%} of the samples are good")
        panel.set_yticks(range(len(flags)), [(flag.name or "").replace("_", " ").lower() for flag in flags])
        panel.set_ylim(max(1, len(flags)) - 0.5, -0.5)
        panel.grid(visible=False)
        if result.time.size > 1:
            panel.set_xlim(result.time[0], result.time[-1])
        everywhere = ", ".join(flag.name or "" for flag in flagged_everywhere(result))
        panel.set_xlabel("time (s)" + (f"\nwhole record: {everywhere}" if everywhere else ""))
    return figure
