"""The paper's figures, by their numbers."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from tvident._arguments import whole_number
from tvident._figures.parameters import DrawableResult, check_single, draw_parameters, unknowns
from tvident._figures.recording import plot_recording
from tvident._figures.style import Place
from tvident._figures.truth import Truth
from tvident._figures.window import plot_window
from tvident._simulate import Recording

_NOISE = 0.05
"""Standard deviation of the noise of figure 5, of that of the angle."""


def paper_figure_2(recording: Recording, ax: Place = None) -> Figure:
    """Draw slider position, torque and angle over time: figure 2 of the paper.

    Parameters
    ----------
    recording : Recording
        From :func:`tvident.simulate_torsional_rig`.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided into three panels. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there are too many or too few axes.

    See Also
    --------
    plot_recording : draws any recording.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figure 2.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> figures.paper_figure_2(tvident.simulate_torsional_rig(duration=2.0)).savefig("figure-2.png")
    """
    return plot_recording(recording, ax=ax)


def paper_figure_4(recording: Recording, i: int | None = None, ax: Place = None) -> Figure:
    """Draw a window of the angle, its polynomial, and the criterion over the order: figure 4 of the paper.

    Parameters
    ----------
    recording : Recording
        From :func:`tvident.simulate_torsional_rig`.
    i : int, optional
        Sample at the window's centre; by default that in the middle.
    ax : sequence of two Axes, optional
        Where to draw. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the record is shorter than a window of 201 samples.

    See Also
    --------
    plot_window : any window of any channel.
    paper_figure_5 : the same with noise.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figure 4.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> figures.paper_figure_4(tvident.simulate_torsional_rig(duration=2.0)).savefig("figure-4.png")
    """
    return _window(recording, 0.0, i, ax)


def paper_figure_5(recording: Recording, i: int | None = None, ax: Place = None, *, seed: int = 1) -> Figure:
    """Draw the same with noise of 5 % in the angle, for which a lower order is chosen: figure 5 of the paper.

    Parameters
    ----------
    recording : Recording
        From :func:`tvident.simulate_torsional_rig`.
    i : int, optional
        Sample at the window's centre; by default that in the middle.
    ax : sequence of two Axes, optional
        Where to draw. By default a new figure.
    seed : int, optional
        Of the noise.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the record is shorter than a window of 201 samples.

    See Also
    --------
    paper_figure_4 : the same without.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figure 5.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> figures.paper_figure_5(tvident.simulate_torsional_rig(duration=2.0)).savefig("figure-5.png")
    """
    drawn = np.random.default_rng(whole_number("seed", seed, least=0)).standard_normal(recording.angle.size)
    return _window(recording, _NOISE * recording.angle.std() * drawn, i, ax)


def _window(
    recording: Recording, noise: float | np.ndarray[tuple[int], np.dtype[np.float64]], i: int | None, ax: Place
) -> Figure:
    middle = recording.angle.size // 2 if i is None else i
    return plot_window(recording.angle + noise, middle, sample_rate=recording.sample_rate, ax=ax)


def paper_figure_6(result: DrawableResult, truth: Truth = None, ax: Place = None) -> Figure:
    """Draw inertia, damping and stiffness over time in a panel each, whatever is constant: figure 6 of the paper.

    Parameters
    ----------
    result : Identification
        Of a single record, with ``method="paper"`` for the paper's numbers.
    truth : Recording or mapping of str to array_like, optional
        A simulated recording, or true numbers or arrays by the names of parameters: they are drawn too, and the error of what was found
        below each.
    ax : sequence of Axes, optional
        Where to draw. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records, or `truth` is none of this result.

    See Also
    --------
    plot_identification : draws time-varying parameters, and names constants.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figure 6.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    >>> figures.paper_figure_6(result, rig).savefig("figure-6.png")
    """
    check_single(result)
    return draw_parameters(result, unknowns(result), truth, ax)
