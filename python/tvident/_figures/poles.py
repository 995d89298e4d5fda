"""A picture of the poles, and of natural frequency and damping ratio over time."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from tvident._figures.parameters import Array, DrawableResult, check_single, draw_flags
from tvident._figures.style import MUTED, TIME_MAP, Place, draw_parameter, legend, panels, style
from tvident._status import DOUBTFUL

_MOST_DOTS = 4000


class DrawablePoles(DrawableResult, Protocol):
    """A result with a natural frequency."""

    damping: Array
    stiffness: Array

    @property
    def natural_frequency(self) -> Array:
        """In Hz."""

    @property
    def damping_ratio(self) -> Array:
        """Without unit."""


def plot_poles(result: DrawablePoles, ax: Place = None) -> Figure:
    """Draw natural frequency and damping ratio over time, with bands of two standard errors, and the poles.

    The poles are the roots of I s² + C s + K: each sample's system as if it stayed as it is then. One that grows has poles right of zero.

    Parameters
    ----------
    result : Identification
        Of a single record.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided into three panels. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records.

    See Also
    --------
    Identification : has natural frequency and damping ratio.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Equation (1).

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=4.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> figures.plot_poles(result).savefig("poles.png")
    """
    check_single(result)
    with style():
        figure, axes = panels(ax, [1.7, 1.7, 2.8], apart=True)
        shown = (("natural_frequency", "Natural frequency", "Hz"), ("damping_ratio", "Damping ratio", ""))
        for panel, (name, title, unit) in zip(axes, shown, strict=False):
            draw_flags(panel, result)
            draw_parameter(panel, result.time, np.asarray(getattr(result, name)), result.stderr[name])
            panel.set_title(title)
            panel.set_ylabel(unit)
            panel.set_xlabel("time (s)")
        legend(axes[0], ax)
        there = np.flatnonzero(np.isfinite(result.inertia) & (result.status & DOUBTFUL == 0) & (result.inertia != 0))
        there = there[:: max(1, there.size // _MOST_DOTS)]
        inertia, damping, stiffness = (one[there] for one in (result.inertia, result.damping, result.stiffness))
        root = np.sqrt((damping / inertia) ** 2 / 4 - stiffness / inertia + 0j)
        panel = axes[2]
        for sign in (-1, 1):
            poles = -damping / inertia / 2 + sign * root
            dots = panel.scatter(poles.real, poles.imag, c=result.time[there], s=6, cmap=TIME_MAP, linewidths=0)
        panel.axvline(0, color=MUTED, linewidth=0.9)
        panel.margins(x=0.2)
        panel.set_title("Poles")
        panel.set_xlabel("real part (1/s)")
        panel.set_ylabel("imaginary part (rad/s)")
        bar = figure.colorbar(dots, ax=panel, pad=0.02, aspect=18)
        bar.set_label("time (s)")
        bar.outline.set_visible(False)
    return figure
