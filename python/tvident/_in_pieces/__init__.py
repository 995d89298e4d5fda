"""Identifies recordings that are longer than memory, from file to file, piece by piece."""

from tvident._in_pieces.call import identify_file
from tvident._in_pieces.choices import Choices, chosen, stretches
from tvident._in_pieces.found import FileIdentification
from tvident._in_pieces.given import Given
from tvident._in_pieces.merged import Mean, means_of
from tvident._in_pieces.work import columns_of, finished, part_alone, reach_of, with_neighbours

__all__ = [
    "Choices",
    "FileIdentification",
    "Given",
    "Mean",
    "chosen",
    "columns_of",
    "finished",
    "identify_file",
    "means_of",
    "part_alone",
    "reach_of",
    "stretches",
    "with_neighbours",
]
