"""Identifies pieces of a recording as records of their own, and puts together what they say of constants."""

from tvident._pieces.alone import (
    SHARED,
    Columns,
    columns_of,
    finished,
    look_ahead,
    part_alone,
    part_estimated,
    reach_of,
    with_neighbours,
)
from tvident._pieces.given import Given
from tvident._pieces.merged import NOTHING_SAID, Gathered, Mean, Note, means_of

__all__ = [
    "NOTHING_SAID",
    "SHARED",
    "Columns",
    "Gathered",
    "Given",
    "Mean",
    "Note",
    "columns_of",
    "finished",
    "look_ahead",
    "means_of",
    "part_alone",
    "part_estimated",
    "reach_of",
    "with_neighbours",
]
