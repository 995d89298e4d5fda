"""A picture of parameters over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvident._figures.style import FAINT, TRUTH, draw_parameter, style, unit_of
from tvident._simulate import Recording
from tvident._status import DOUBTFUL, Status

Array: TypeAlias = npt.NDArray[np.float64]

_SYMBOLS = {"inertia": "Inertia $I$", "damping": "Damping $C$", "stiffness": "Stiffness $K$"}


class Identified(Protocol):
    """What is drawn of an identification: see :class:`tvident.Identification`."""

    time: Array
    inertia: Array
    terms: dict[str, Array]
    constants: dict[str, tuple[Any, Any]]
    status: npt.NDArray[np.uint16]
    record_status: Status | npt.NDArray[np.uint16]
    settings: dict[str, Any]

    @property
    def stderr(self) -> Mapping[str, Array]:
        """Standard errors by name."""


def plot_identification(result: Identified, truth: Recording | None = None) -> Figure:
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

    See Also
    --------
    Identification.plot : the same as a method.

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
    if result.inertia.ndim != 1:
        raise ValueError(
            f"only a single record can be drawn; this one has shape {result.inertia.shape}; take one record"
        )
    extra = list(result.terms)
    shown = [name for name in _SYMBOLS if result.settings["kinds"][name] != "known"] + extra
    with style():
        figure, axes = plt.subplots(
            len(shown), 1, sharex=True, squeeze=False, figsize=(8.4, 1.2 + 1.8 * len(shown)), layout="constrained"
        )
        for ax, name in zip(axes[:, 0], shown, strict=True):
            values = result.terms[name] if name in result.terms else getattr(result, name)
            title = _SYMBOLS.get(name, name.capitalize())
            _draw_flags(ax, result)
            draw_parameter(ax, result.time, values, result.stderr[name])
            if truth is not None and hasattr(truth, name):
                ax.plot(truth.time, getattr(truth, name), color=TRUTH, linewidth=1.2, label="truth")
            if name in result.constants:
                value, error = result.constants[name]
                title += f": {value:.5g} ± {error:.2g} {unit_of(name)}".rstrip()
                true = getattr(truth, name)[0] if truth is not None and hasattr(truth, name) else value
                _frame_constant(ax, value, error, true)
            ax.set_title(title)
            ax.set_ylabel(unit_of(name))
        # Beside the first title, where no line runs through it.
        place: Any = {"loc": "lower right", "bbox_to_anchor": (1, 0.97), "borderaxespad": 0.2}
        axes[0, 0].legend(ncols=4, handlelength=1.4, columnspacing=1.4, **place)
        everywhere = ", ".join(flag.name or "" for flag in _everywhere(result))
        axes[-1, 0].set_xlabel("time (s)" + (f"\nwhole record: {everywhere}" if everywhere else ""))
        figure.align_ylabels()
        return figure


def _everywhere(result: Identified) -> list[Status]:
    """Return the flags of the record, and those that all samples have."""
    common = int(np.bitwise_and.reduce(result.status)) if result.status.size else 0
    return [flag for flag in Status if (common | int(result.record_status)) & flag]


def _draw_flags(ax: Axes, result: Identified) -> None:
    """Shade samples whose numbers deserve a second look; what holds at all samples is said elsewhere."""
    time, doubtful = result.time, DOUBTFUL | Status.GAP
    for flag in _everywhere(result):
        doubtful &= ~flag
    flagged = result.status & doubtful != 0
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
