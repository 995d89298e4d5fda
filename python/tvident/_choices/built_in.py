"""The built-in terms: the one place in Python that knows them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class BuiltIn:
    """A term that the core has by the same name.

    Parameters
    ----------
    name : str
        What it is called.
    unit : str
        Unit of its factor.
    meaning : str
        What its factor multiplies.
    suspicion : str
        What is said where it seems to be missing, with a place for the amount.
    inner : mapping of str to str
        Units of inner parameters, which a search finds, by name.
    """

    name: str
    unit: str
    meaning: str
    suspicion: str
    inner: Mapping[str, str] = field(default_factory=dict)


BUILT_IN = {
    term.name: term
    for term in (
        BuiltIn("offset", "N m", "1: a constant torque", "a constant torque of {amount} seems to act"),
        BuiltIn("coulomb", "N m", "the sign of the velocity: dry friction", "dry friction of {amount} seems to act"),
        BuiltIn(
            "cubic",
            "N m/rad^3",
            "the cube of the angle: a hardening spring",
            "the spring seems to harden or soften, by {amount}",
        ),
        BuiltIn("gravity", "N m", "the sine of the angle: a pendulum", "gravity of {amount} seems to act"),
        BuiltIn(
            "viscous_asymmetric",
            "N m s/rad",
            "the magnitude of the velocity: viscous friction that differs between the directions",
            "viscous friction seems to differ between the directions, by {amount}",
        ),
        BuiltIn(
            "stribeck",
            "N m",
            "exp(-(velocity/Stribeck velocity)²) times the sign of the velocity: friction that fades as motion becomes faster",
            "friction seems to fade with the velocity, by {amount}",
            {"velocity": "rad/s"},
        ),
    )
}
"""Built-in terms by name."""

TERM_NAMES = tuple(BUILT_IN)
