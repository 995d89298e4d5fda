"""A picture of one window and of the choice of its order."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident import _arguments as arguments
from tvident._derivatives import SHORTEST_WINDOW, LocalPolynomialFit, fit_local_polynomials
from tvident._figures.style import ACCENT, FAINT, FOUND, INK, MUTED, Place, panels, style


def plot_window(
    y: npt.ArrayLike,
    i: int,
    window_length: int = 201,
    *,
    sample_rate: float = 1.0,
    max_order: int = 15,
    ax: Place = None,
) -> Figure:
    """Draw a window with the polynomial chosen for it and the criterion over the order.

    Parameters
    ----------
    y : array_like, shape (n,)
        Samples. Masked ones are missing, as NaN is.
    i : int
        Sample at the window's centre; near an end, the first or last full window is drawn.
    window_length : int, optional
        Samples in the window, odd.
    sample_rate : float, optional
        Samples per second.
    max_order : int, optional
        Highest candidate order.
    ax : sequence of two Axes, optional
        Where to draw. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the window is even, too short or longer than the record, the order is too high, or there are several records.
    TypeError
        If `y` holds no numbers, or a number is not whole.

    See Also
    --------
    fit_local_polynomials : chooses an order in every window.
    paper_figure_4, paper_figure_5 : the paper's windows.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figures 4 and 5.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> figure = figures.plot_window(rig.angle, 1000, sample_rate=1000)
    >>> figure.savefig("window.png")
    """
    samples = arguments.real_array("y", y).astype(np.float64, copy=False)
    if samples.ndim != 1:
        raise ValueError(f"y must be a single record; got an array of shape {samples.shape}; take one record")
    place, period = arguments.whole_number("i", i), arguments.sample_period(samples.size, sample_rate=sample_rate)
    length = arguments.window_length("window_length", window_length, period, odd=True)
    arguments.check_window("window_length", length, samples.size, least=SHORTEST_WINDOW)
    half = length // 2
    centre = min(max(place, half), samples.size - 1 - half)
    window = samples[centre - half : centre + half + 1]
    fit = fit_local_polynomials(window, length, sample_rate=sample_rate, max_order=max_order)
    with style():
        if ax is None:
            figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
        else:
            figure, (left, right) = panels(ax, [1.0, 1.0])
        _draw_window(left, fit, window, centre, sample_rate)
        _draw_scores(right, fit.scores(half))
        return figure


def _draw_window(ax: Axes, fit: LocalPolynomialFit, window: npt.NDArray[Any], centre: int, sample_rate: float) -> None:
    half = window.size // 2
    order = int(fit.order[half])
    time = (centre + np.arange(-half, half + 1)) / sample_rate
    polynomial = fit_local_polynomials(window, window.size, sample_rate=sample_rate, order=order, max_deriv=0)
    ax.plot(time, window, ".", color=FAINT, markersize=4, label="samples")
    ax.plot(time, polynomial.derivatives[0], color=FOUND, label=f"polynomial of order {order}")
    ax.plot(time[half], polynomial.derivatives[0, half], "o", color=ACCENT, markersize=5)
    ax.set_title(f"Window of {window.size} samples")
    ax.set_xlabel("time (s)")
    ax.set_ylabel("angle (rad)")
    ax.legend(loc="best")


def _draw_scores(ax: Axes, scores: npt.NDArray[np.float64]) -> None:
    candidates = np.isfinite(scores)
    orders = np.arange(scores.size)
    best = int(np.where(candidates, scores, np.inf).argmin())
    ax.plot(orders[candidates], scores[candidates], "-o", color=MUTED, markersize=3.5, linewidth=1)
    ax.plot(best, scores[best], "o", color=ACCENT, markersize=8)
    ax.annotate(f"n = {best}", (best, scores[best]), xytext=(0, 10), textcoords="offset points", ha="center", color=INK)
    ax.set_title("Akaike's criterion by order")
    ax.set_xlabel("order n")
    ax.set_ylabel("AICc")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.margins(y=0.15)
