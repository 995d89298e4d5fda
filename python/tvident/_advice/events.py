"""What happened in a record at some times only, in words."""

from __future__ import annotations

from tvident import _core


def lost_samples(found: _core.Identification) -> list[str]:
    """Return at how many places samples seem to be lost."""
    return [
        f"the angle jumps between two samples at {amount:.0f} place{'' if amount == 1 else 's'}, as it does where samples are lost: "
        "equations over such a place were left out; if a recorder loses samples, record their times"
        for _, defect, amount in found.defects
        if defect == "broken"
    ]
