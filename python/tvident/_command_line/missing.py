"""The command ``tvident`` where what it is made with is not installed."""

from __future__ import annotations

import sys


def main(*, prog_name: str = "tvident") -> None:
    """Say what to install, and end."""
    sys.exit(
        f"Error: the command {prog_name} needs click, which is not installed; install it with: pip install 'tvident[cli]'"
    )
