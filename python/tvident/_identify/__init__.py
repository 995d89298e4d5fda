"""Turns a call of ``identify`` into a task for the core: forms, settings, the task, its numbers by name."""

from tvident._identify.call import identify
from tvident._identify.criterion import aicc, effective_observations
from tvident._identify.exchanged import asked_of_exchanged, takes_work
from tvident._identify.methods import Method, StrongForm, WeakForm
from tvident._identify.offered import contradicted
from tvident._identify.parts import Held, Long, Rows, Span, estimate_part, identify_part, requested
from tvident._identify.settings import Request, resolve
from tvident._identify.tried_record import CONTRADICTED
from tvident._identify.weighted import MOST_OF_FIRST

__all__ = [
    "CONTRADICTED",
    "MOST_OF_FIRST",
    "Held",
    "Long",
    "Method",
    "Request",
    "Rows",
    "Span",
    "StrongForm",
    "WeakForm",
    "aicc",
    "asked_of_exchanged",
    "contradicted",
    "effective_observations",
    "estimate_part",
    "identify",
    "identify_part",
    "requested",
    "resolve",
    "takes_work",
]
