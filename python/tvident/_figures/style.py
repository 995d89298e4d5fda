"""The style of all figures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tvident._equation import UNITS

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


@contextmanager
def style() -> Iterator[None]:
    with mpl.rc_context(_STYLE), np.errstate(all="ignore"):
        yield


def unit_of(name: str) -> str:
    """Return a unit as it is printed."""
    return UNITS.get(name, "").replace("^2", "²").replace("^3", "³").replace(" ", "·")


def draw_parameter(
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
