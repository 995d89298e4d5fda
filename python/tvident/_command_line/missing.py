"""The command ``tvident`` where what it is made with is not installed."""

from __future__ import annotations

import sys


def main() -> None:
    """Say what to install, and end."""
    sys.exit(
        "Error: the command tvident needs click, which is not installed; install it with: pip install 'tvident[cli]'"
    )
