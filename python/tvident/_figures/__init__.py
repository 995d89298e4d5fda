"""Draws recordings and results; needs matplotlib."""

try:
    import matplotlib as mpl  # noqa: F401
except ImportError as error:  # pragma: no cover - the extra is installed where tests run
    raise ImportError(
        "plots need matplotlib, which is not installed; install it with: pip install 'tvident[plot]'"
    ) from error

from tvident._figures.derivatives import plot_derivatives
from tvident._figures.expansion import plot_expansion
from tvident._figures.models import plot_models
from tvident._figures.paper import paper_figure_2, paper_figure_4, paper_figure_5, paper_figure_6
from tvident._figures.parameters import plot_identification, plot_over_position
from tvident._figures.poles import plot_poles
from tvident._figures.recording import plot_recording
from tvident._figures.records import plot_records
from tvident._figures.scan import plot_scan
from tvident._figures.status import plot_status
from tvident._figures.torque import plot_torque
from tvident._figures.window import plot_window

__all__ = [
    "paper_figure_2",
    "paper_figure_4",
    "paper_figure_5",
    "paper_figure_6",
    "plot_derivatives",
    "plot_expansion",
    "plot_identification",
    "plot_models",
    "plot_over_position",
    "plot_poles",
    "plot_recording",
    "plot_records",
    "plot_scan",
    "plot_status",
    "plot_torque",
    "plot_window",
]
