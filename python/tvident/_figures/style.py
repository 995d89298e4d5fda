"""The style of all figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident._equation import UNITS
from tvident._files import printable

Array: TypeAlias = npt.NDArray[np.float64]

Place: TypeAlias = Axes | Sequence[Axes] | npt.NDArray[Any] | None
"""Where to draw: on axes of the user's own, or on new ones."""

INK, MUTED, OTHER, FAINT = "#22303c", "#5b6b79", "#7d8b97", "#c3ccd4"
"""Colours of titles, of labels, of what stands beside what was found, of frames and recorded samples."""

FOUND, TRUTH, ACCENT = "#0072b2", "#d55e00", "#00b060"
"""Colours of what was found, is true, was chosen: distinguished by colour-blind eyes too. Blue and vermilion are those of Okabe and
Ito; their green is as near to the blue as 17 (CIELAB) without short-wave cones, this one 23."""

TIME_MAP = "cividis"
"""Colours of time: even in lightness, and the same to colour-blind eyes."""

_MOST_POINTS = 8000
"""Of a line: more than a printed page has columns."""

_LONGEST_NAME = 60
"""Characters of a channel's name in a picture."""

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


@contextmanager
def style() -> Iterator[None]:
    with mpl.rc_context(_STYLE), np.errstate(all="ignore"):
        yield


def unit_of(name: str, units: Mapping[str, str] = UNITS) -> str:
    """Return a unit as it is printed."""
    return units.get(name, "").replace("^2", "²").replace("^3", "³").replace(" ", "·")


def panels(
    ax: Place, heights: Sequence[float], *, width: float = 8.4, apart: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return axes below each other that share their time, heights in inches: of a new figure, those given, or in the place of one.

    Where they do not share an axis they are `apart`.
    """
    count = len(heights)
    if ax is None:
        figure, axes = plt.subplots(
            count,
            1,
            sharex=not apart,
            squeeze=False,
            figsize=(width, 0.7 + sum(heights)),
            height_ratios=list(heights),
            layout="constrained",
        )
        return figure, list(axes[:, 0])
    if not isinstance(ax, Axes):
        given = list(np.ravel(np.asarray(ax, dtype=object)))
        if len(given) != count or not all(isinstance(one, Axes) for one in given):
            raise ValueError(
                f"ax must be one Axes, or {count} of them for this picture; got {len(given)}; give {count}"
            )
        return _figure_of(given[0]), given
    if count == 1:
        return _figure_of(ax), [ax]
    ax.set_axis_off()
    total, top, shared = sum(heights), 1.0, None
    inside = []
    place, between = ax.get_subplotspec(), _between(ax, count, apart=apart)
    if place is not None:
        # By the mean height of a panel.
        hspace = between * count / (1 - between * (count - 1))
        grid = place.subgridspec(count, 1, height_ratios=list(heights), hspace=hspace)
        for row in range(count):
            inside.append(_figure_of(ax).add_subplot(grid[row], sharex=shared))
            shared = None if apart else inside[0]
    else:
        for height in heights:
            share = height / total * (1 - between * (count - 1))
            inside.append(ax.inset_axes((0, top - share, 1, share), sharex=shared))
            shared, top = None if apart else inside[0], top - share - between
    for one in inside[:-1] if not apart else []:
        one.tick_params(labelbottom=False)
    return _figure_of(ax), inside


def _between(ax: Axes, count: int, *, apart: bool) -> float:
    """Return the share of axes that is left between two panels inside: for a title, and for words of an axis where each has its own."""
    inches = ax.get_window_extent().height / float(_figure_of(ax).dpi)
    wanted = (0.8 if apart else 0.35) / max(inches, 0.1)
    return min(wanted, 0.5 / (count - 1))


def _figure_of(ax: Axes) -> Any:
    """Return the figure, or the part of one, that axes stand in."""
    return ax.figure


def envelope(time: Array, values: Array) -> tuple[Array, Array, Array]:
    """Return times with the least and the greatest value around each: no sample is lost, however many there are."""
    every = -(-time.size // (_MOST_POINTS // 2))
    if every <= 2:  # noqa: PLR2004 - two points stand for two samples
        return time, values, values
    count = time.size // every * every
    rows = values[:count].reshape(-1, every)
    return time[:count:every], np.fmin.reduce(rows, axis=1), np.fmax.reduce(rows, axis=1)


def draw_line(ax: Axes, time: Array, values: npt.NDArray[Any], **how: Any) -> None:
    """Draw a line through every sample, or through the least and greatest around each of some thousand times."""
    at, low, high = envelope(time, np.asarray(values, np.float64))
    if low is high:
        ax.plot(at, low, **how)
    else:
        ax.plot(np.repeat(at, 2), np.stack([low, high], axis=1).ravel(), **how)


def draw_parameter(ax: Axes, time: Array, values: Array, errors: Array, *, label: str = "identified") -> None:
    """Draw values with a band of two standard errors, on a scale that shows most of both."""
    at, low, _ = envelope(time, values - 2 * errors)
    high = envelope(time, values + 2 * errors)[2]
    band: Any = {"color": FOUND, "alpha": 0.25, "linewidth": 0, "label": "± 2 standard errors"}
    ax.fill_between(at, low, high, **band)
    draw_line(ax, time, values, color=FOUND, linewidth=1.0, label=label)
    scale(ax, values, values - 2 * errors, values + 2 * errors)
    if time.size > 1:
        ax.set_xlim(time[0], time[-1])


def scale(ax: Axes, *lines: Array) -> None:
    """Show all but the last hundredth of lines on each side: a spike does not hide the rest."""
    ends = []
    for line in lines:
        finite = line[np.isfinite(line)]
        if finite.size:
            ends += list(np.percentile(finite, [1, 99]))
    if ends:
        low, high = min(ends), max(ends)
        room = 0.2 * (high - low) or 0.1 * abs(high) or 1.0
        ax.set_ylim(low - room, high + room)
    ax.yaxis.set_major_locator(MaxNLocator(4))


def legend(ax: Axes, place: Place = None) -> None:
    """Name what is drawn: beside the title of a figure of our own, where no line runs through it, and inside of axes of the user's."""
    if place is None:
        beside: Any = {"loc": "lower right", "bbox_to_anchor": (1, 0.97), "borderaxespad": 0.2}
        ax.legend(ncols=5, handlelength=1.4, columnspacing=1.4, **beside)
    else:
        ax.legend(
            loc="upper right", ncols=2, fontsize=7.5, handlelength=1.2, frameon=True, framealpha=0.8, edgecolor="none"
        )


def plain(name: str) -> str:
    r"""Return a name that is no formula, has no control characters (``\x07``), and is no longer than a title beside its axes may be."""
    return printable(name, _LONGEST_NAME).replace("$", r"\$")
