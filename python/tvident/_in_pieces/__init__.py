"""Identifies recordings that are longer than memory, from file to file, piece by piece."""

from tvident._in_pieces.call import identify_file
from tvident._in_pieces.choices import Choices, chosen, stretches
from tvident._in_pieces.found import FileIdentification
from tvident._in_pieces.sources import names_in
from tvident._in_pieces.told_by_weak_form import ToldByWeakForm, stretches_told

__all__ = [
    "Choices",
    "FileIdentification",
    "ToldByWeakForm",
    "chosen",
    "identify_file",
    "names_in",
    "stretches",
    "stretches_told",
]
