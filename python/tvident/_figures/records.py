"""A picture of several records: what changes over time, what is constant by record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident._equation import COEFFICIENTS
from tvident._figures.parameters import DrawableResult, title_of, unknowns, value_of
from tvident._figures.style import FOUND, MUTED, TIME_MAP, Place, draw_line, legend, panels, scale, style, unit_of
from tvident._status import DOUBTFUL

_MOST = 24
"""Records of a picture: more lines are none that an eye tells apart."""

_NAMED = 8
"""Records that a legend names one by one."""


def plot_records(
    results: Sequence[DrawableResult], *, shared: Mapping[str, tuple[float, float]] | None = None, ax: Place = None
) -> Figure:
    """Draw parameters of several records: one line a record where they change, one point with two standard errors where constant.

    Samples that cannot be trusted are left out.

    Parameters
    ----------
    results : sequence of Identification
        Each of a single record, at most 24.
    shared : mapping of str to (float, float), optional
        What records share, with errors: a line with a band.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided if there are several panels. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there are no records, or too many.

    See Also
    --------
    plot_identification : one record, with its errors over time.
    IdentifiedRecords.plot : the same as a method.

    References
    ----------
    P. Kovesi: Good colour maps: how to design them, arXiv:1509.03700 (2015): even steps of lightness, by which records are told apart.

    Examples
    --------
    >>> import tvident
    >>> from tvident import figures
    >>> rigs = [tvident.simulate_torsional_rig(duration=2.0, seed=seed) for seed in range(3)]
    >>> found = tvident.identify([rig.angle for rig in rigs], [rig.torque for rig in rigs], sample_rate=1000)
    >>> figures.plot_records(list(found)).savefig("records.png")
    """
    if not 1 <= len(results) <= _MOST:
        raise ValueError(f"a picture must show 1 to {_MOST} records; got {len(results)}; draw some: result[:{_MOST}]")
    found = {*(shared or {}), *(name for result in results for name in unknowns(result))}
    names = [name for name in (*COEFFICIENTS, *results[0].terms) if name in found]
    moving = [name for name in names if any(name not in one.constants for one in results)]
    fixed = [name for name in names if name not in moving]
    with style():
        figure, axes = panels(ax, [2.1] * len(moving) + [1.5] * len(fixed) or [1.0], apart=True)
        for panel, name in zip(axes, moving, strict=False):
            _draw_moving(panel, results, name)
        for panel, name in zip(axes[len(moving) :], fixed, strict=False):
            _draw_fixed(panel, results, name, (shared or {}).get(name))
        if moving and 1 < len(results) <= _NAMED:
            legend(axes[0], ax)
        return figure


def _draw_moving(ax: Axes, results: Sequence[DrawableResult], name: str) -> None:
    """Draw a parameter of every record over its time."""
    colours = colormaps[TIME_MAP](np.linspace(0, 0.9, len(results)))
    drawn = []
    for place, result in enumerate(results):
        values = np.where(result.status & DOUBTFUL == 0, value_of(result, name), np.nan)
        draw_line(ax, result.time, values, color=colours[place], linewidth=1.0, label=f"record {place}")
        drawn.append(values)
    scale(ax, np.concatenate(drawn))
    _titled(ax, results[0], name)
    ax.set_xlabel("time (s)")


def _draw_fixed(ax: Axes, results: Sequence[DrawableResult], name: str, shared: tuple[float, float] | None) -> None:
    """Draw a constant of every record with two standard errors; what all share is a line with a band."""
    found = [np.asarray(one.constants.get(name, (np.nan, np.nan)), np.float64) for one in results]
    values, errors = np.array(found).T
    if shared is None or not np.isfinite(shared).all():
        how: Any = {"fmt": "o", "color": FOUND, "markersize": 4, "elinewidth": 1.2}
        ax.errorbar(np.arange(len(results)), values, 2 * errors, **how)
    else:
        value, error = shared
        ax.axhline(value, color=MUTED, linewidth=0.9)
        ax.axhspan(value - 2 * error, value + 2 * error, color=MUTED, alpha=0.2, linewidth=0)
    ax.set_xlim(-0.5, len(results) - 0.5)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.yaxis.set_major_locator(MaxNLocator(4))
    _titled(ax, results[0], name)
    ax.set_xlabel("record")


def _titled(ax: Axes, result: DrawableResult, name: str) -> None:
    ax.set_title(title_of(name))
    ax.set_ylabel(unit_of(name, result.units))
