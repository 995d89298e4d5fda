"""Holds the result of an identification: parameters by name, standard errors, natural frequency, the summary."""

from tvident._results.estimates import Estimates
from tvident._results.recorded import Recorded
from tvident._results.result import Identification
from tvident._results.scan import Scan
from tvident._results.words import Words

__all__ = ["Estimates", "Identification", "Recorded", "Scan", "Words"]
