"""Draws recordings and results; needs matplotlib."""

try:
    import matplotlib as mpl  # noqa: F401
except ImportError as error:  # pragma: no cover - the extra is installed where tests run
    raise ImportError(
        "plots need matplotlib, which is not installed; install it with: pip install 'tvident[plot]'"
    ) from error

from tvident._figures.derivatives import plot_derivatives
from tvident._figures.models import plot_models
from tvident._figures.parameters import plot_identification
from tvident._figures.recording import plot_recording
from tvident._figures.scan import plot_scan
from tvident._figures.window import plot_window

__all__ = ["plot_derivatives", "plot_identification", "plot_models", "plot_recording", "plot_scan", "plot_window"]
