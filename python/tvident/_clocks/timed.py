"""What was done to the times of channels: in words, and in what settings keep of it."""

from __future__ import annotations

from typing import Any, Final, Protocol

SETTINGS_OF_TIMES: Final = ("times", "spline_order", "bridged", "clock_offset", "clock_drift")
"""What settings of results keep of times, whatever was identified."""


class Timed(Protocol):
    """How channels were brought onto a uniform grid, or what lies between their samples was replaced."""

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep."""

    @property
    def words(self) -> str:
        """What was done."""
