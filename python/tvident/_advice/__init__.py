"""Puts into words what was chosen, why, and what to do next."""

from tvident._advice.channels import held, spoilt
from tvident._advice.collinear import NOT_DISTINGUISHED
from tvident._advice.events import events_that_stay, untold, without_numbers
from tvident._advice.expansion import FoundExpansion, found_expansion, words_of_expansions
from tvident._advice.gains import changes_of_gain
from tvident._advice.instrument import fed_back_in_records, words_with_instrument
from tvident._advice.marks import Numbers, marks_that_stay, without_masked_marks
from tvident._advice.plausible import SWAPPED, Plausible, asked_of_signs, certain_sign
from tvident._advice.search import FoundBySearch, words_of_search
from tvident._advice.strong import ExplainedStrong
from tvident._advice.undescribed import LAG_NOT_TOLD, in_vain, none_there
from tvident._advice.weak import FREE_OFFSET, Explained

__all__ = [
    "FREE_OFFSET",
    "LAG_NOT_TOLD",
    "NOT_DISTINGUISHED",
    "SWAPPED",
    "Explained",
    "ExplainedStrong",
    "FoundBySearch",
    "FoundExpansion",
    "Numbers",
    "Plausible",
    "asked_of_signs",
    "certain_sign",
    "changes_of_gain",
    "events_that_stay",
    "fed_back_in_records",
    "found_expansion",
    "held",
    "in_vain",
    "marks_that_stay",
    "none_there",
    "spoilt",
    "untold",
    "without_masked_marks",
    "without_numbers",
    "words_of_expansions",
    "words_of_search",
    "words_with_instrument",
]
