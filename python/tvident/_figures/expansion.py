"""Draws a parameter over what it is a function of, with its band, beside the criterion of every size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident import _arguments as arguments
from tvident._figures.style import ACCENT, FOUND, MUTED, TRUTH, Place, legend, panels, plain, style

_SHOWN = 60.0
"""Criteria that are so much higher than the lowest are beyond the panel."""


class Expanded(Protocol):
    """What is drawn of an expanded parameter: see :class:`tvident.ExpandedParameter`."""

    @property
    def name(self) -> str:
        """The parameter."""

    @property
    def family(self) -> str:
        """Of the functions."""

    @property
    def sizes(self) -> Mapping[str, npt.NDArray[Any]]:
        """Those that were tried."""

    @property
    def unit(self) -> str:
        """Of the parameter."""

    @property
    def unit_of(self) -> str:
        """Of what it is a function of."""

    @property
    def size(self) -> Any:
        """How many functions there are."""

    @property
    def position(self) -> Any:
        """Places."""

    @property
    def value(self) -> npt.NDArray[np.float64]:
        """The curve there."""

    @property
    def stderr(self) -> npt.NDArray[np.float64]:
        """Its standard error."""


def plot_expansion(
    curve: Expanded, *, truth: Callable[[npt.NDArray[np.float64]], npt.ArrayLike] | None = None, ax: Place = None
) -> Figure:
    """Draw a parameter over what it is a function of, with a band of two standard errors, and the criterion of every size.

    Parameters
    ----------
    curve : ExpandedParameter
        Of one channel, or of time.
    truth : callable, optional
        The true curve, as a function of the position.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided where several sizes were tried. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If it is a function of two channels.

    See Also
    --------
    plot_over_position : windows over a channel.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Section 4: the stiffness follows the position of a slider.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=8.0)
    >>> spring = tvident.Expansion("bspline", of=rig.slider_position)
    >>> result = tvident.identify(
    ...     rig.angle, rig.torque, sample_rate=1000, inertia="constant", damping="constant", stiffness=spring
    ... )
    >>> figures.plot_expansion(result.expansions["stiffness"], truth=lambda x: 6 / x).savefig("over_slider.png")
    """
    position = curve.position
    if not isinstance(position, np.ndarray):
        raise ValueError(  # noqa: TRY004 - a curve of another shape
            f"only a function of one channel can be drawn; {curve.name} is one of two; draw value over both positions"
        )
    tried = np.asarray(curve.sizes["size"])
    several = tried.size > 1
    with style():
        figure, axes = panels(ax, [3.2, 1.6] if several else [3.2], width=6.4, apart=True)
        value, error = curve.value, curve.stderr
        main = axes[0]
        main.fill_between(position, value - 2 * error, value + 2 * error, color=FOUND, alpha=0.25, linewidth=0)
        main.plot(position, value, color=FOUND, label=f"{curve.size} functions ({plain(curve.family)})")
        if truth is not None and not callable(truth):
            raise TypeError(
                f"truth must be a function of the position; got {arguments.shown(truth)}; pass lambda x: 6 / x, say"
            )
        if truth is not None:
            main.plot(position, np.asarray(truth(position)), color=TRUTH, linewidth=0.9, linestyle="--", label="truth")
            legend(main)
        main.set_title(f"{curve.name.capitalize()} with two standard errors")
        main.set_ylabel(curve.unit)
        main.set_xlabel(f"what it is a function of ({curve.unit_of})" if curve.unit_of else "what it is a function of")
        if several:
            above = np.asarray(curve.sizes["criterion"]) - np.min(curve.sizes["criterion"])
            there = above <= _SHOWN
            panel = axes[1]
            panel.plot(tried[there], above[there], color=MUTED, marker="o", markersize=3, linewidth=0.8)
            panel.plot(curve.size, above[tried == curve.size], color=ACCENT, marker="o", markersize=6)
            panel.set_xlabel("number of functions")
            panel.set_ylabel("criterion")
            panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure
