"""Brings channels whose times are not uniform onto a uniform grid, and says what was done."""

from tvident._clocks.clock import Clock, Evened, clock_of
from tvident._clocks.grid import Grid, grid_of, in_no_gap, weights_on_grid
from tvident._clocks.held import holds_that_stay, unheld
from tvident._clocks.missing import Bridged, bridged
from tvident._clocks.passed import Passed
from tvident._clocks.timed import SETTINGS_OF_TIMES, Timed
from tvident._clocks.two import TwoClocks, two_clocks

__all__ = [
    "SETTINGS_OF_TIMES",
    "Bridged",
    "Clock",
    "Evened",
    "Grid",
    "Passed",
    "Timed",
    "TwoClocks",
    "bridged",
    "clock_of",
    "grid_of",
    "holds_that_stay",
    "in_no_gap",
    "two_clocks",
    "unheld",
    "weights_on_grid",
]
