"""Identifies what repeated trials or coupled masses share, from rows that are merged."""

from tvident._merged.bridges import masses_over_gaps, trials_over_gaps
from tvident._merged.call import AskedTogether, TermValues, identify_trials
from tvident._merged.earlier import Earlier
from tvident._merged.loaded import load
from tvident._merged.masses import Masses, identify_masses, masses_of
from tvident._merged.mechanism import Mechanism
from tvident._merged.merging import Identifiable, LackingTerm, LackingTerms, Part
from tvident._merged.result import MergedIdentification, parts_of_result, that_lacks
from tvident._merged.sampling import Sampling
from tvident._merged.structure import Chain, Link, Matrix, between
from tvident._merged.trials import Trials, trials_of
from tvident._merged.weighted import of_core, weights_of_trials
from tvident._merged.words import angles_of, link_of

__all__ = [
    "AskedTogether",
    "Chain",
    "Earlier",
    "Identifiable",
    "LackingTerm",
    "LackingTerms",
    "Link",
    "Masses",
    "Matrix",
    "Mechanism",
    "MergedIdentification",
    "Part",
    "Sampling",
    "TermValues",
    "Trials",
    "angles_of",
    "between",
    "identify_masses",
    "identify_trials",
    "link_of",
    "load",
    "masses_of",
    "masses_over_gaps",
    "of_core",
    "parts_of_result",
    "that_lacks",
    "trials_of",
    "trials_over_gaps",
    "weights_of_trials",
]
