"""A picture of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tvident import _arguments as arguments
from tvident._figures.style import FOUND, MUTED, Place, draw_line, panels, plain, style
from tvident._simulate import Recording
from tvident._units import Channel, named_unit, times_in_seconds, unit_said, with_unit


def plot_recording(
    recording: Recording | Mapping[str, npt.ArrayLike], *, sample_rate: float | None = None, ax: Place = None
) -> Figure:
    """Draw the channels of a recording below each other.

    However long a recording is, the least and greatest sample of every column are drawn: a spike of one sample is seen.

    Parameters
    ----------
    recording : Recording or mapping of str to array_like, shape (n,)
        From :func:`tvident.simulate_torsional_rig` or :func:`tvident.read_recording`, or channels by name; a unit may follow the name in
        brackets, and a channel ``time``, ``t`` or the like says when.
    sample_rate : float, optional
        Samples per second of channels without time.
    ax : Axes or sequence of Axes, optional
        Where to draw; one Axes is divided into a panel for each channel. By default a new figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is no channel, channels differ in length, or neither a time nor a sample rate is given.

    See Also
    --------
    simulate_torsional_rig : simulates a recording.
    paper_figure_2 : the paper's picture of its recording.

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
    if isinstance(recording, Recording):
        time = recording.time
        channels: dict[str, npt.NDArray[Any]] = {
            "slider position [m]": recording.slider_position,
            "torque [N·m]": recording.torque,
            "angle [rad]": recording.angle,
        }
    else:
        for name, one in recording.items():
            arguments.check_in_memory(f"recording[{name!r}]", one)
        named = {with_unit(name, "" if named_unit(name)[1] else unit_said(one)): one for name, one in recording.items()}
        channels = {name: np.asarray(values) for name, values in named.items() if np.ndim(values)}
        time = _time(channels, sample_rate)
    with style():
        figure, axes = panels(ax, [1.6] * len(channels), width=8.0)
        for number, (panel, (name, values)) in enumerate(zip(axes, channels.items(), strict=True)):
            title, unit = named_unit(name)
            draw_line(panel, time, values, color=FOUND if number == len(channels) - 1 else MUTED, linewidth=0.9)
            panel.set_title(plain(title[:1].upper() + title[1:]))
            panel.set_ylabel(plain(unit))
            panel.yaxis.set_major_locator(MaxNLocator(4))
            panel.margins(x=0)
        axes[-1].set_xlabel("time (s)")
        if ax is None:
            figure.align_ylabels()
        return figure


def _is_time(full: str, values: npt.NDArray[Any]) -> bool:
    """Return whether a channel is called as times are, in a unit of time or none. A torque may be called t, but decreases."""
    name, unit = (one.strip() for one in named_unit(full))
    return arguments.is_time(name, unit) and (name.lower() == "time" or not (values[1:] < values[:-1]).any())


def _time(channels: dict[str, npt.NDArray[Any]], sample_rate: float | None) -> npt.NDArray[np.float64]:
    """Take the time out of channels, or make it."""
    named = [name for name, values in channels.items() if _is_time(name, values)]
    time = None
    if named:
        given = channels.pop(named[0])
        time = arguments.times_of(times_in_seconds(Channel(given, named_unit(named[0])[1])))
    sizes = {values.shape for values in channels.values()}
    if len(sizes) != 1 or len(next(iter(sizes))) != 1:
        raise ValueError(f"channels must be single records of one length; got shapes {sorted(sizes)}; cut them")
    (samples,) = next(iter(sizes))
    if time is not None and time.shape == (samples,):
        return time.astype(np.float64)
    if sample_rate is None or not sample_rate > 0:
        raise ValueError(
            f"a recording needs its time; got sample_rate={sample_rate}; give sample_rate= or a channel 'time'"
        )
    return np.arange(samples) / sample_rate
