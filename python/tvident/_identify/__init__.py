"""Takes one call apart: what is given, what is chosen, what the core is to do."""

from tvident._identify.call import identify
from tvident._identify.settings import Form, Preset, Selection, Variation

__all__ = [
    "Form",
    "Preset",
    "Selection",
    "Variation",
    "identify",
]
