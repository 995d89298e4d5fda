"""The paper's figures, and those of results. Needs matplotlib: install ``tvident[plot]``."""

from tvident._figures import plot_derivatives, plot_identification, plot_recording, plot_scan, plot_window

__all__ = ["plot_derivatives", "plot_identification", "plot_recording", "plot_scan", "plot_window"]
