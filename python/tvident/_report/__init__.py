"""Writes a report: one page that shows a result and its recording without a network."""

from tvident._report.content import Reported
from tvident._report.packed import Series
from tvident._report.written import check_plotly, write_report

__all__ = ["Reported", "Series", "check_plotly", "write_report"]
