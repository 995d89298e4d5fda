"""The built-in terms: the one place in Python that knows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


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
    function : callable
        Gives what its factor multiplies, of NumPy, which names are known without, of angle and velocity; of inner parameters, too, where it
        has some.
    inner : mapping of str to str
        Units of inner parameters, which a search finds, by name.
    needs_velocity : bool
        Whether the velocity is asked for.
    """

    name: str
    unit: str
    meaning: str
    suspicion: str
    function: Callable[..., Any]
    inner: Mapping[str, str] = field(default_factory=dict)
    needs_velocity: bool = True


BUILT_IN = {
    term.name: term
    for term in (
        BuiltIn(
            "offset",
            "N m",
            "1: a constant torque",
            "a constant torque of {amount} seems to act",
            lambda numpy, angle, _: numpy.ones_like(angle),
            needs_velocity=False,
        ),
        BuiltIn(
            "coulomb",
            "N m",
            "the sign of the velocity: dry friction",
            "dry friction of {amount} seems to act",
            lambda numpy, _, velocity: numpy.sign(velocity),
        ),
        BuiltIn(
            "cubic",
            "N m/rad^3",
            "the cube of the angle: a hardening spring",
            "the spring seems to harden or soften, by {amount}",
            lambda _, angle, __: angle**3,
            needs_velocity=False,
        ),
        BuiltIn(
            "gravity",
            "N m",
            "the sine of the angle: a pendulum",
            "gravity of {amount} seems to act",
            lambda numpy, angle, _: numpy.sin(angle),
            needs_velocity=False,
        ),
        BuiltIn(
            "viscous_asymmetric",
            "N m s/rad",
            "the magnitude of the velocity: viscous friction that differs between the directions",
            "viscous friction seems to differ between the directions, by {amount}",
            lambda numpy, _, velocity: numpy.abs(velocity),
        ),
        BuiltIn(
            "stribeck",
            "N m",
            "exp(-(velocity/Stribeck velocity)²) times the sign of the velocity: friction that fades as motion becomes faster",
            "friction seems to fade with the velocity, by {amount}",
            lambda numpy, _, velocity, stribeck: numpy.exp(-((velocity / stribeck) ** 2)) * numpy.sign(velocity),
            {"velocity": "rad/s"},
        ),
    )
}
"""Built-in terms by name."""

TERM_NAMES = tuple(BUILT_IN)
