"""Identifies what repeated trials or coupled masses share, from rows that are merged."""

from tvident._merged.bridges import masses_over_gaps, trials_over_gaps
from tvident._merged.call import AskedTogether, identify_trials
from tvident._merged.earlier import Earlier
from tvident._merged.loaded import load
from tvident._merged.masses import Masses, identify_masses, masses_of
from tvident._merged.mechanism import Mechanism
from tvident._merged.merging import Identifiable
from tvident._merged.result import MergedIdentification
from tvident._merged.sampling import Sampling
from tvident._merged.structure import Chain, Matrix
from tvident._merged.trials import Trials, trials_of
from tvident._merged.weighted import of_core, weights_of_trials

__all__ = [
    "AskedTogether",
    "Chain",
    "Earlier",
    "Identifiable",
    "Masses",
    "Matrix",
    "Mechanism",
    "MergedIdentification",
    "Sampling",
    "Trials",
    "identify_masses",
    "identify_trials",
    "load",
    "masses_of",
    "masses_over_gaps",
    "of_core",
    "trials_of",
    "trials_over_gaps",
    "weights_of_trials",
]
