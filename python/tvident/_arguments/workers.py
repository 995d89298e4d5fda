"""How many threads work."""

from __future__ import annotations

import os

from tvident._arguments.numbers import whole_number
from tvident._arguments.shown import shown


def worker_count(workers: int | None) -> int | None:
    """Return how many threads to use, or None for all processors that this process may use."""
    if workers is not None:
        return whole_number("workers", workers, least=1)
    setting = os.environ.get("TVIDENT_WORKERS", "").strip()
    if not setting:
        return None
    # No word of more than nine digits counts processors, and Python reads none of more than 4300.
    if not (setting.isascii() and setting.isdigit() and len(setting) < 10 and int(setting) > 0):  # noqa: PLR2004
        raise ValueError(
            f"TVIDENT_WORKERS must be a whole number above zero; got {shown(setting)}; set it to 1 or more"
        )
    return int(setting)
