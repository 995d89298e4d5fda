"""A picture of the recorded torque beside the predicted one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from tvident._figures.parameters import Array, DrawableResult, check_single, draw_flags
from tvident._figures.style import ACCENT, FOUND, MUTED, Place, draw_line, legend, panels, scale, style, unit_of
from tvident._units import in_words_of


class Predicting(DrawableResult, Protocol):
    """A result that predicts the torque."""

    def predicted_torque(self) -> tuple[Array, Array, Array]:
        """Return time, the recorded torque and the predicted one."""


def plot_torque(result: Predicting, ax: Place = None) -> Figure:
    """Draw the recorded torque, the one that the identified equation predicts from the angle, and what is left.

    Both are what the method compares: in weak form averages over its test function, in strong form the torque and the derivatives of the
    local polynomials. What is left should look like noise: a residual that follows the motion says what the equation lacks.

    Parameters
    ----------
    result : Identification
        Of a single record that is still there.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided into two panels. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records, or was stored without its record.

    See Also
    --------
    Identification.predicted_torque : the numbers.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Equation (1).

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> figures.plot_torque(result).savefig("torque.png")
    """
    check_single(result)
    time, recorded, predicted = result.predicted_torque()
    left, unit = recorded - predicted, unit_of("torque", result.units)
    with style():
        figure, (above, below) = panels(ax, [2.6, 1.3])
        draw_flags(above, result)
        draw_line(above, time, recorded, color=MUTED, linewidth=1.6, alpha=0.55, label="recorded")
        draw_line(
            above,
            time,
            predicted,
            color=FOUND,
            linewidth=0.9,
            label=in_words_of(result.units, "predicted from the angle"),
        )
        draw_line(below, time, left, color=ACCENT, linewidth=0.8)
        name = in_words_of(result.units, "Torque")
        above.set_title(f"{name}, averaged over the test function" if result.settings["form"] == "weak" else name)
        below.set_title(_left_in_words(left, recorded, result.units))
        scale(above, recorded, predicted)
        scale(below, left)
        for panel in (above, below):
            panel.set_ylabel(unit)
            panel.margins(x=0)
        legend(above, ax)
        below.set_xlabel("time (s)")
        if ax is None:
            figure.align_ylabels()
    return figure


def _left_in_words(left: Array, recorded: Array, units: Mapping[str, str]) -> str:
    """Return how much is left, in its unit and as a share."""
    there = np.isfinite(left)
    if not there.any():
        return "Nothing is predicted: there are no parameters"
    rms, of = (float(np.sqrt(np.mean(one[there] ** 2))) for one in (left, recorded))
    share = in_words_of(units, f", {rms / of:.2g} of the torque") if of > 0 else ""
    return f"What is left: {rms:.3g} {unit_of('torque', units)} rms{share}"
