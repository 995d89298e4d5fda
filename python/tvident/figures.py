"""The paper's figures, and those of results. Needs matplotlib: install ``tvident[plot]``."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tvident.derivatives import LocalPolynomialFit, fit_local_polynomials
from tvident.result import UNITS, Identification
from tvident.rig import Recording
from tvident.status import Status

try:
    import matplotlib as mpl
    from matplotlib import pyplot as plt
    from matplotlib.ticker import MaxNLocator
except ImportError as error:  # pragma: no cover - the extra is installed where tests run
    raise ImportError(
        "plots need matplotlib, which is not installed; install it with: pip install 'tvident[plot]'"
    ) from error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED, FAINT = "#22303c", "#5b6b79", "#c3ccd4"
"""Colours of titles, of labels, of frames and recorded samples."""
FOUND, TRUTH, ACCENT = "#2f7fc1", "#d9480f", "#2a9d6f"
"""Colours of what was found, what is true, what was chosen."""

_STYLE: Any = {
    "figure.dpi": 110,
    "figure.constrained_layout.h_pad": 0.08,
    "figure.constrained_layout.w_pad": 0.08,
    "savefig.dpi": 160,
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.titlepad": 7,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": MUTED,
    "text.color": INK,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": MUTED,
    "ytick.labelcolor": MUTED,
    "ytick.major.size": 0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": "#e8ecef",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "lines.linewidth": 1.3,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.labelcolor": INK,
}

_SYMBOLS = {"inertia": "Inertia $I$", "damping": "Damping $C$", "stiffness": "Stiffness $K$"}


@contextmanager
def _style() -> Iterator[None]:
    with mpl.rc_context(_STYLE):
        yield


def _unit(name: str) -> str:
    """Return a unit as it is printed."""
    return UNITS.get(name, "").replace("^2", "²").replace("^3", "³").replace(" ", "·")


def plot_recording(recording: Recording) -> Figure:
    """Draw slider position, torque and angle over time: figure 2 of the paper.

    Parameters
    ----------
    recording : Recording
        From :func:`tvident.simulate_torsional_rig`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> figure = figures.plot_recording(tvident.simulate_torsional_rig(duration=2.0))
    >>> figure.savefig("recording.png")
    """
    with _style():
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


def plot_window(
    y: npt.ArrayLike, i: int, window_length: int = 201, *, sample_rate: float = 1.0, max_order: int = 15
) -> Figure:
    """Draw a window with the polynomial chosen for it and the criterion over the order: figures 4 and 5 of the paper.

    Parameters
    ----------
    y : array_like, shape (n,)
        Samples.
    i : int
        Sample at the window's centre.
    window_length : int, optional
        Samples in the window, odd.
    sample_rate : float, optional
        Samples per second.
    max_order : int, optional
        Highest candidate order.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the window is even, too short or longer than the record, or the order is too high.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> figure = figures.plot_window(rig.angle, 1000, sample_rate=1000)
    >>> figure.savefig("window.png")
    """
    samples = np.asarray(y, dtype=np.float64)
    half = window_length // 2
    centre = int(np.clip(i, half, samples.size - 1 - half))
    window = samples[centre - half : centre + half + 1]
    fit = fit_local_polynomials(window, window_length, sample_rate=sample_rate, max_order=max_order)
    with _style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
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
    ax.annotate(
        f"n = {best}", (best, scores[best]), xytext=(0, 10), textcoords="offset points", ha="center", color=ACCENT
    )
    ax.set_title("Akaike's criterion by order")
    ax.set_xlabel("order n")
    ax.set_ylabel("AICc")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.margins(y=0.15)


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
    with _style():
        figure = plt.figure(figsize=(8, 1.4 + 1.6 * count), layout="constrained")
        axes = figure.subplots(count + 1, 1, sharex=True)
        for d, ax in enumerate(axes[:-1]):
            _draw_parameter(ax, time, fit.derivatives[d], fit.stderr[d])
            ax.set_title(name if d == 0 else f"{name}: derivative {d}")
        axes[-1].plot(time, fit.order, ".", color=INK, markersize=1.5)
        axes[-1].set_title("Order")
        axes[-1].yaxis.set_major_locator(MaxNLocator(integer=True))
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels()
        return figure


def plot_identification(result: Identification, truth: Recording | None = None) -> Figure:
    """Draw inertia, damping and stiffness over time, with bands of two standard errors: figure 6 of the paper.

    What is constant over the record is a line with its value in the title. Grey stretches have flags, as many as their samples'
    status says; what is flagged over the whole record is named below the last panel instead.

    Parameters
    ----------
    result : Identification
        Of a single record.
    truth : Recording, optional
        A simulated recording: its true values are drawn too.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> figures.plot_identification(result, rig).savefig("parameters.png")
    """
    if result.inertia.ndim != 1:
        raise ValueError(
            f"only a single record can be drawn; this one has shape {result.inertia.shape}; take one record"
        )
    extra = list(result.terms)
    shown = [name for name in _SYMBOLS if result.settings["kinds"][name] != "known"] + extra
    with _style():
        figure, axes = plt.subplots(
            len(shown), 1, sharex=True, squeeze=False, figsize=(8.4, 1.2 + 1.8 * len(shown)), layout="constrained"
        )
        for ax, name in zip(axes[:, 0], shown, strict=True):
            values = result.terms[name] if name in result.terms else getattr(result, name)
            title = _SYMBOLS.get(name, name.capitalize())
            _draw_flags(ax, result.time, result.status)
            _draw_parameter(ax, result.time, values, result.stderr[name])
            if truth is not None and hasattr(truth, name):
                ax.plot(truth.time, getattr(truth, name), color=TRUTH, linewidth=1.2, label="truth")
            if name in result.constants:
                value, error = result.constants[name]
                title += f": {value:.5g} ± {error:.2g} {_unit(name)}".rstrip()
                true = getattr(truth, name)[0] if truth is not None and hasattr(truth, name) else value
                _frame_constant(ax, value, error, true)
            ax.set_title(title)
            ax.set_ylabel(_unit(name))
        # Beside the first title, where no line runs through it.
        place: Any = {"loc": "lower right", "bbox_to_anchor": (1, 0.97), "borderaxespad": 0.2}
        axes[0, 0].legend(ncols=4, handlelength=1.4, columnspacing=1.4, **place)
        everywhere = ", ".join(flag.name or "" for flag in _everywhere(result.status))
        axes[-1, 0].set_xlabel("time (s)" + (f"\nwhole record: {everywhere}" if everywhere else ""))
        figure.align_ylabels()
        return figure


def _everywhere(status: npt.NDArray[np.uint16]) -> list[Status]:
    """Return the flags that all samples have, or all but those near the ends."""
    common = int(np.bitwise_and.reduce(status)) if status.size else 0
    return [flag for flag in Status if common & flag]


def _draw_flags(ax: Axes, time: npt.NDArray[np.float64], status: npt.NDArray[np.uint16]) -> None:
    """Shade samples whose numbers deserve a second look; what holds for the whole record is said elsewhere."""
    doubtful = Status.INVALID | Status.GAP | Status.RANK_DEFICIENT | Status.ILL_CONDITIONED
    for flag in _everywhere(status):
        doubtful &= ~flag
    flagged = status & doubtful != 0
    if not flagged.any():
        return
    edges = np.flatnonzero(np.diff(flagged.astype(np.int8), prepend=0, append=0))
    shade: Any = {"color": FAINT, "alpha": 0.4, "linewidth": 0}
    spans = np.stack([time[edges[::2]], time[edges[1::2] - 1]], axis=1)
    # Thousands of slivers are one grey area on any screen.
    for number, (first, last) in enumerate(spans[:: max(1, len(spans) // 500)]):
        ax.axvspan(first, last, label="flagged" if number == 0 else None, **shade)


def _frame_constant(ax: Axes, value: float, error: float, true: float) -> None:
    """Show a constant from near enough to see its band, and the truth."""
    reach = 1.3 * max(6 * error, abs(true - value), 0.01 * abs(value))
    if np.isfinite(reach) and reach > 0:
        ax.set_ylim(value - reach, value + reach)


def _draw_parameter(
    ax: Axes, time: npt.NDArray[np.float64], values: npt.NDArray[np.float64], errors: npt.NDArray[np.float64]
) -> None:
    # More points than a screen has columns only cost time.
    every = max(1, time.size // 20_000)
    time, values, errors = time[::every], values[::every], errors[::every]
    band: Any = {"color": FOUND, "alpha": 0.22, "linewidth": 0, "label": "± 2 standard errors"}
    ax.fill_between(time, values - 2 * errors, values + 2 * errors, **band)
    ax.plot(time, values, color=FOUND, linewidth=1.0, label="identified")
    ax.yaxis.set_major_locator(MaxNLocator(5))
    finite = values[np.isfinite(values)]
    if finite.size:
        low, high = np.percentile(finite, [1, 99])
        room = 0.35 * (high - low) or 0.1 * abs(high) or 1.0
        ax.set_ylim(low - room, high + room)
    if time.size > 1:
        ax.set_xlim(time[0], time[-1])
