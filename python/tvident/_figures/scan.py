"""A picture of estimates by the width of the test function."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from tvident._figures.style import FAINT, FOUND, OTHER, Place, legend, panels, style, unit_of

Array = npt.NDArray[np.float64]


class Scanned(Protocol):
    """What is drawn of a scan: see :class:`tvident.Scan`."""

    @property
    def window_length(self) -> npt.NDArray[np.int64]:
        """Samples of each test function."""

    @property
    def band(self) -> Array:
        """Where half the power passes, in Hz."""

    @property
    def units(self) -> Mapping[str, str]:
        """Units by name."""

    @property
    def estimates(self) -> dict[str, Array]:
        """Unknowns by name."""

    @property
    def stderr(self) -> dict[str, Array]:
        """Their standard errors."""

    @property
    def plateau(self) -> tuple[int, int] | None:
        """The narrowest and the widest test function that agree."""


def plot_scan(scan: Scanned, ax: Place = None) -> Figure:
    """Draw every unknown over the band in which the equation is asked to hold, with bars of two standard errors.

    Parameters
    ----------
    scan : Scan
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided into a panel for each unknown. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the record was too short to compare widths.

    See Also
    --------
    Scan.plot : the same as a method.

    References
    ----------
    O. V. Lepski: On a problem of adaptive estimation in Gaussian white noise, Theory of Probability and its Applications 35 (1990).

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=4.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> figures.plot_scan(result.scan()).savefig("scan.png")
    """
    if not scan.window_length.size:
        raise ValueError(
            "there is nothing to draw: got a record too short to compare different widths; record 20 cycles or more"
        )
    agree = np.zeros(scan.window_length.size, bool)
    if scan.plateau is not None:
        agree = (scan.plateau[0] <= scan.window_length) & (scan.window_length <= scan.plateau[1])
    with style():
        figure, axes = panels(ax, [1.6] * len(scan.estimates))
        for panel, (name, values) in zip(axes, scan.estimates.items(), strict=True):
            error = scan.stderr[name]
            bars: Any = {"fmt": "o", "markersize": 3.5, "elinewidth": 1.2}
            if agree.any():
                panel.axvspan(
                    scan.band[agree].min(),
                    scan.band[agree].max(),
                    color=FAINT,
                    alpha=0.35,
                    linewidth=0,
                    label="plateau",
                )
            for chosen, colour, label in ((agree, FOUND, "these agree"), (~agree, OTHER, "others")):
                if chosen.any():
                    panel.errorbar(
                        scan.band[chosen], values[chosen], 2 * error[chosen], color=colour, label=label, **bars
                    )
            shown = agree if agree.any() else np.ones(agree.size, bool)
            low, high = (values - 3 * error)[shown].min(), (values + 3 * error)[shown].max()
            reach = 1.5 * (high - low)
            if np.isfinite(reach) and reach > 0:
                panel.set_ylim(low - reach, high + reach)
            panel.set_title(name.replace("_", " ").capitalize())
            panel.set_ylabel(unit_of(name, scan.units))
        axes[0].set_xscale("log")
        legend(axes[0], ax)
        axes[-1].set_xlabel("the equation is asked to hold up to (Hz)")
        if ax is None:
            figure.align_ylabels()
        return figure
