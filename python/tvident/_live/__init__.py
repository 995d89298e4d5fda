"""Takes channels from where they are recorded while they are recorded, and gives parameters to who watches."""

from tvident._live.clock import LiveClock
from tvident._live.lines import Lines
from tvident._live.lsl import Inlet, Outlet
from tvident._live.session import Session
from tvident._live.shown import JsonLines, LiveTable, Udp

__all__ = ["Inlet", "JsonLines", "Lines", "LiveClock", "LiveTable", "Outlet", "Session", "Udp"]
