"""A picture of a recording."""

from __future__ import annotations

from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident._figures.style import ACCENT, FOUND, MUTED, style
from tvident._simulate import Recording


def plot_recording(recording: Recording) -> Figure:
    """Draw slider position, torque and angle over time: figure 2 of the paper.

    Parameters
    ----------
    recording : Recording
        From :func:`tvident.simulate_torsional_rig`.

    Returns
    -------
    matplotlib.figure.Figure

    See Also
    --------
    simulate_torsional_rig : simulates a recording.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figure 2.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> figure = figures.plot_recording(tvident.simulate_torsional_rig(duration=2.0))
    >>> figure.savefig("recording.png")
    """
    with style():
        figure, axes = plt.subplots(3, 1, sharex=True, figsize=(8, 5.4), layout="constrained")
        channels = (
            ("Slider position", recording.slider_position, "m", ACCENT),
            ("Torque", recording.torque, "N·m", MUTED),
            ("Angle", recording.angle, "rad", FOUND),
        )
        for ax, (title, values, unit, colour) in zip(axes, channels, strict=True):
            ax.plot(recording.time, values, color=colour, linewidth=0.9)
            ax.set_title(title)
            ax.set_ylabel(unit)
            ax.yaxis.set_major_locator(MaxNLocator(4))
            ax.margins(x=0)
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels()
        return figure
