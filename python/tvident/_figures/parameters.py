"""Pictures of parameters over time, and over a position."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath
from matplotlib.ticker import MaxNLocator

from tvident import _arguments as arguments
from tvident._figures.style import (
    FAINT,
    FOUND,
    MUTED,
    TIME_MAP,
    TRUTH,
    Place,
    draw_line,
    draw_parameter,
    legend,
    panels,
    plain,
    scale,
    style,
    unit_of,
)
from tvident._figures.truth import Truth, truth_at
from tvident._status import DOUBTFUL, Status, stretches_of

Array: TypeAlias = npt.NDArray[np.float64]

_SYMBOLS = {"inertia": "Inertia $I$", "damping": "Damping $C$", "stiffness": "Stiffness $K$"}

_CONSTANTS_SIZE = 9.5
"""Points of the letters of constants."""

_POINTS = 72.0
"""Of an inch."""


class DrawableResult(Protocol):
    """What is drawn of an identification: see :class:`tvident.Identification`."""

    time: Array
    inertia: Array
    terms: dict[str, Array]
    constants: dict[str, tuple[Any, Any]]
    status: npt.NDArray[np.uint16]
    record_status: Status | npt.NDArray[np.uint16]
    order: npt.NDArray[np.uint8]
    settings: dict[str, Any]
    units: Mapping[str, str]

    @property
    def stderr(self) -> Mapping[str, Array]:
        """Standard errors by name."""


def check_single(result: DrawableResult) -> None:
    """Refuse several records."""
    if result.inertia.ndim != 1:
        raise ValueError(
            f"only a single record can be drawn; this one has shape {result.inertia.shape}; take one record"
        )


def plot_identification(result: DrawableResult, truth: Truth = None, ax: Place = None) -> Figure:
    """Draw time-varying parameters with bands of two standard errors; constants are one line of text.

    Scales leave out a hundredth of the values on each side, so that a spike does not hide the rest. Grey stretches have flags, as many
    as their samples' status says; what is flagged over the whole record is named below the last panel instead.

    Parameters
    ----------
    result : Identification
        Of a single record.
    truth : Recording or mapping of str to array_like, optional
        A simulated recording, or true numbers or arrays by the names of parameters: they are drawn too, and the error of what was found
        below each.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided if there are several panels. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records, there are too many or too few axes, or `truth` is none of this result.

    See Also
    --------
    Identification.plot : the same as a method.
    paper_figure_6 : all three parameters as the paper shows them.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Figure 6.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=2.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> figures.plot_identification(result, rig).savefig("parameters.png")
    """
    check_single(result)
    shown = [name for name in unknowns(result) if name not in result.constants]
    return draw_parameters(result, shown, truth, ax)


def unknowns(result: DrawableResult) -> list[str]:
    """Return the parameters that were not known."""
    return [name for name in (*_SYMBOLS, *result.terms) if result.settings["kinds"][name] != "known"]


def draw_parameters(result: DrawableResult, shown: list[str], truth: Truth, ax: Place) -> Figure:
    """Draw parameters over time in panels of their own, and those that are constant as text above."""
    of_truth = truth_at(np.asarray(result.time), truth, (*_SYMBOLS, *result.terms))
    constants = _constants(result, of_truth)
    heights = [height for name in shown for height in ([2.1, 0.9] if name in of_truth else [2.1])]
    with style():
        figure, axes = panels(ax, heights or [1.0 + 0.3 * len(constants)])
        if not shown:
            _draw_constants_alone(axes[0], constants)
            return figure
        rest = iter(axes)
        for name in shown:
            panel = next(rest)
            values = value_of(result, name)
            draw_flags(panel, result)
            draw_parameter(panel, result.time, values, result.stderr[name])
            panel.set_title(title_of(name))
            panel.set_ylabel(unit_of(name, result.units))
            if name in of_truth:
                true = of_truth[name]
                draw_line(panel, result.time, true, color=TRUTH, linewidth=1.1, linestyle=(0, (5, 2)), label="truth")
                _draw_error(next(rest), result, name, values - true)
        if constants:
            first = axes[0].get_title(loc="left")
            lines = _packed(constants, _width(figure, axes[0] if ax is not None else None))
            axes[0].set_title("\n".join(lines), color=MUTED, fontsize=_CONSTANTS_SIZE, fontweight="normal", pad=28)
            axes[0].text(0, 1.03, first, transform=axes[0].transAxes, fontsize=10.5, fontweight="bold", va="bottom")
        legend(axes[0], ax)
        everywhere = ", ".join(flag.name or "" for flag in flagged_everywhere(result))
        axes[-1].set_xlabel("time (s)" + (f"\nwhole record: {everywhere}" if everywhere else ""))
        if ax is None:
            figure.align_ylabels()
        return figure


def value_of(result: DrawableResult, name: str) -> Array:
    """Return a parameter or the factor of a term."""
    return result.terms[name] if name in result.terms else np.asarray(getattr(result, name))


def title_of(name: str) -> str:
    """Return what a parameter is called above its panel."""
    return _SYMBOLS.get(name, plain(name.replace("_", " ").capitalize()))


def _constants(result: DrawableResult, of_truth: Mapping[str, Array]) -> list[str]:
    """Return what is constant, in words."""
    words = []
    for name, (value, error) in result.constants.items():
        line = f"{title_of(name)}: {arguments.with_error(value, error)} {unit_of(name, result.units)}".rstrip()
        if name in of_truth:
            line += f" (truth {np.mean(of_truth[name]):.5g})"
        words.append(line)
    return words


def _width(figure: Any, ax: Axes | None) -> float:
    """Return how many inches a line may have above axes of the user's own, or in a new figure."""
    if ax is None:
        return float(figure.get_figure(root=True).get_size_inches()[0]) - 0.9
    root = ax.get_figure(root=True)
    return ax.get_window_extent().width / root.dpi if root is not None else 4.0


def _packed(words: list[str], inches: float) -> list[str]:
    """Return words on as few lines as they fit on."""
    lines: list[str] = []
    for one in words:
        longer = f"{lines[-1]}   {one}" if lines else one
        if lines and TextPath((0, 0), longer, size=_CONSTANTS_SIZE).get_extents().width <= inches * _POINTS:
            lines[-1] = longer
        else:
            lines.append(one)
    return lines


def _draw_constants_alone(ax: Axes, constants: list[str]) -> None:
    """Say what was found where nothing changes."""
    ax.set_axis_off()
    ax.set_title("Constant over the record")
    ax.text(0, 0.96, "\n".join(constants) or "nothing unknown", transform=ax.transAxes, va="top", linespacing=1.8)


def _draw_error(ax: Axes, result: DrawableResult, name: str, error: Array) -> None:
    """Draw the error beside two standard errors, which should hold 95 % of it."""
    reach = 2 * result.stderr[name]
    ax.fill_between(result.time, -reach, reach, color=FOUND, alpha=0.25, linewidth=0)
    draw_line(ax, result.time, error, color=TRUTH, linewidth=0.9)
    scale(ax, error, reach, -reach)
    ax.yaxis.set_major_locator(MaxNLocator(3))
    ax.set_ylabel("error")


def flagged_everywhere(result: DrawableResult) -> list[Status]:
    """Return the flags of the record, and those that all samples have."""
    common = int(np.bitwise_and.reduce(result.status)) if result.status.size else 0
    return [flag for flag in Status if (common | int(result.record_status)) & flag]


def draw_flags(ax: Axes, result: DrawableResult) -> None:
    """Shade samples whose numbers deserve a second look; what holds at all samples is said elsewhere."""
    time, doubtful = result.time, DOUBTFUL | Status.GAP
    for flag in flagged_everywhere(result):
        doubtful &= ~flag
    flagged = result.status & doubtful != 0
    if not flagged.any():
        return
    begins, ends = stretches_of(flagged)
    shade: Any = {"color": FAINT, "alpha": 0.4, "linewidth": 0}
    spans = np.stack([time[begins], time[ends - 1]], axis=1)
    # Thousands of slivers are one grey area on any screen.
    for number, (first, last) in enumerate(spans[:: max(1, len(spans) // 500)]):
        ax.axvspan(first, last, label="flagged" if number == 0 else None, **shade)


def plot_over_position(
    result: DrawableResult,
    position: npt.ArrayLike,
    *,
    name: str = "stiffness",
    label: str = "position",
    ax: Place = None,
) -> Figure:
    """Draw a parameter over a channel, the stiffness over the position of a joint say; colour is time.

    Where a parameter depends on the position alone, all passes lie on one curve. Samples that cannot be trusted are left out.

    Parameters
    ----------
    result : Identification
        Of a single record.
    position : array_like, shape (n,)
        A value for each of the result's samples.
    name : str, optional
        Parameter or term.
    label : str, optional
        What the channel is called, with its unit.
    ax : Axes, optional
        Where to draw. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the result holds several records, has no such parameter, or the channel has another number of samples.

    See Also
    --------
    plot_identification : the same over time.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    Section 4: the stiffness follows the position of a slider.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rig = tvident.simulate_torsional_rig(duration=8.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> figures.plot_over_position(result, rig.slider_position, label="slider (m)").savefig("over_position.png")
    """
    check_single(result)
    if name not in (*_SYMBOLS, *result.terms):
        raise ValueError(
            f"name must be a parameter of the result; got {name!r}; give one of {(*_SYMBOLS, *result.terms)}"
        )
    arguments.check_in_memory("position", position)
    places = np.asarray(position, np.float64)
    if places.shape != result.time.shape:
        raise ValueError(
            f"position must have a value for each of the result's {result.time.size} samples; got shape {places.shape}; cut it, or take "
            "every step-th sample"
        )
    values, error = value_of(result, name), result.stderr[name]
    with style():
        figure, (panel,) = panels(ax, [3.6], width=6.4)
        there = np.flatnonzero(np.isfinite(values) & np.isfinite(places) & (result.status & DOUBTFUL == 0))
        there = there[:: max(1, there.size // 4000)]
        panel.errorbar(
            places[there],
            values[there],
            2 * error[there],
            fmt="none",
            ecolor=FOUND,
            elinewidth=0.6,
            alpha=0.18,
            zorder=1,
        )
        dots = panel.scatter(
            places[there], values[there], c=result.time[there], s=5, cmap=TIME_MAP, linewidths=0, zorder=2
        )
        scale(panel, values[there], values[there] - 2 * error[there], values[there] + 2 * error[there])
        panel.set_title(f"{title_of(name)} over {plain(label)}")
        panel.set_xlabel(plain(label))
        panel.set_ylabel(unit_of(name, result.units))
        bar = figure.colorbar(dots, ax=panel, pad=0.02, aspect=30)
        bar.set_label("time (s)")
        bar.outline.set_visible(False)
    return figure
