"""Pictures of recordings and results, and the paper's figures. Needs matplotlib: install ``tvident[plot]``."""

from tvident._figures import (
    paper_figure_2,
    paper_figure_4,
    paper_figure_5,
    paper_figure_6,
    plot_derivatives,
    plot_expansion,
    plot_identification,
    plot_over_position,
    plot_poles,
    plot_recording,
    plot_records,
    plot_scan,
    plot_status,
    plot_torque,
    plot_window,
)

__all__ = [
    "paper_figure_2",
    "paper_figure_4",
    "paper_figure_5",
    "paper_figure_6",
    "plot_derivatives",
    "plot_expansion",
    "plot_identification",
    "plot_over_position",
    "plot_poles",
    "plot_recording",
    "plot_records",
    "plot_scan",
    "plot_status",
    "plot_torque",
    "plot_window",
]
