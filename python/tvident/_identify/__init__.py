"""Takes one call apart: what is given, what is chosen, what the core is to do."""

from tvident._identify.call import identify
from tvident._identify.methods import Method, StrongForm, Variation, WeakForm

__all__ = ["Method", "StrongForm", "Variation", "WeakForm", "identify"]
