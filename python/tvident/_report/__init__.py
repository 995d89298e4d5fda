"""Writes a report: one page that shows a result and its recording without a network."""

from tvident._report.channels import check_page, check_title, names_of_channels, samples_shown, series_of, write_page
from tvident._report.content import Compared, Curve, ShownResult, title_of, unit_of
from tvident._report.packed import Series
from tvident._report.several import ShownList, check_count
from tvident._report.written import check_plotly, write_list

__all__ = [
    "Compared",
    "Curve",
    "Series",
    "ShownList",
    "ShownResult",
    "check_count",
    "check_page",
    "check_plotly",
    "check_title",
    "names_of_channels",
    "samples_shown",
    "series_of",
    "title_of",
    "unit_of",
    "write_list",
    "write_page",
]
