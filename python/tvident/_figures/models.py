"""Draws a comparison of models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from tvident._figures.style import ACCENT, FOUND, style


def plot_models(table: Mapping[str, npt.NDArray[Any]]) -> Figure:
    """Draw the weight of every model as a bar, with the difference of its criterion beside it.

    Parameters
    ----------
    table : mapping of str to ndarray
        ``ModelComparison.table``: ``"model"``, ``"difference"`` and ``"weight"``, the best first.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with style():
        count = table["model"].size
        figure, ax = plt.subplots(figsize=(7, 1.2 + 0.34 * count), layout="constrained")
        places = np.arange(count)
        ax.barh(places, table["weight"], color=[ACCENT] + [FOUND] * (count - 1), height=0.62)
        for place, weight, difference in zip(places, table["weight"], table["difference"], strict=True):
            ax.annotate(f" +{difference:.1f}", (weight, place), va="center", fontsize=8.5)
        ax.set_yticks(places, [str(name) for name in table["model"]])
        ax.invert_yaxis()
        ax.set_xlim(0, 1.12)
        ax.grid(visible=False)
        ax.set_xlabel("Akaike weight; beside it how much higher the criterion is than the best model's")
        ax.set_title("Models compared")
    return figure
