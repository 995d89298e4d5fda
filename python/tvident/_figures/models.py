"""Draws a comparison of models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from tvident._figures.style import ACCENT, FOUND, Place, panels, plain, style


def plot_models(table: Mapping[str, npt.NDArray[Any]], ax: Place = None) -> Figure:
    """Draw the weight of every model as a bar, with the difference of its criterion beside it.

    Parameters
    ----------
    table : mapping of str to ndarray
        ``ModelComparison.table``: ``"model"``, ``"difference"`` and ``"weight"``, the best first.
    ax : Axes, optional
        Where to draw. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with style():
        count = table["model"].size
        figure, (panel,) = panels(ax, [0.5 + 0.34 * count], width=7.0)
        places = np.arange(count)
        panel.barh(places, table["weight"], color=[ACCENT] + [FOUND] * (count - 1), height=0.62)
        for place, weight, difference in zip(places, table["weight"], table["difference"], strict=True):
            panel.annotate(f" +{difference:.1f}", (weight, place), va="center", fontsize=8.5)
        panel.set_yticks(places, [plain(str(name)) for name in table["model"]])
        panel.invert_yaxis()
        panel.set_xlim(0, 1.12)
        panel.grid(visible=False)
        panel.set_xlabel("Akaike weight; beside it how much higher the criterion is than the best model's")
        panel.set_title("Models compared")
    return figure
