"""The built-in terms: the one place in Python that knows them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal


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
    negative_suspicion : str, optional
        What is said instead where its factor is negative, if that is another thing.
    function : callable
        Gives what its factor multiplies, of NumPy, which names are known without, of angle and velocity; of inner parameters, too, where it
        has some.
    inner : mapping of str to str
        Units of inner parameters, which a search finds, by name.
    needs_velocity : bool
        Whether the velocity is asked for.
    angle_period : float, optional
        Angle in rad after which the function repeats itself: 0 where it does not depend on the angle, None where it never does. Only an
        axis that turns has terms with a period.
    spring : {"beside", "instead"}, optional
        Whether it goes beside a stiffness, as a spring that hardens does, or may take its place, as a pendulum does.
    dissipates : bool
        Whether a negative factor would drive the motion, which friction does not.
    is_sought : bool
        Whether it is looked for in strong form where it is left out; in weak form the core's table says it.
    """

    name: str
    unit: str
    meaning: str
    suspicion: str
    function: Callable[..., Any]
    inner: Mapping[str, str] = field(default_factory=dict)
    needs_velocity: bool = True
    angle_period: float | None = 0.0
    spring: Literal["beside", "instead"] | None = None
    dissipates: bool = False
    is_sought: bool = False
    negative_suspicion: str | None = None

    def suspected(self, value: float, amount: str) -> str:
        """Return what is said where it seems to be missing with a factor, which is the amount in words."""
        negative = self.negative_suspicion if value < 0 else None
        return (negative or self.suspicion).format(amount=amount)

    @property
    def beginnings(self) -> tuple[str, ...]:
        """How sentences begin that say it is missing."""
        return tuple(words.partition("{")[0] for words in (self.suspicion, self.negative_suspicion) if words)

    @property
    def is_of_angle(self) -> bool:
        """Whether the function depends on the angle."""
        return self.angle_period != 0

    def repeats_after(self, angle: float) -> bool:
        """Return whether the function is the same where the angle is larger by so many rad; no period is 0."""
        if not self.angle_period:
            return not self.is_of_angle
        return angle != 0 and (angle / self.angle_period).is_integer()


OFFSET, FRICTION = "offset", "coulomb"
"""A constant torque, of which every equation has one by default, and dry friction, at which machines stick."""


BUILT_IN = {
    term.name: term
    for term in (
        BuiltIn(
            OFFSET,
            "N m",
            "1: a constant torque",
            "a constant torque of {amount} seems to act",
            lambda numpy, angle, _: numpy.ones_like(angle),
            needs_velocity=False,
        ),
        BuiltIn(
            FRICTION,
            "N m",
            "the sign of the velocity: dry friction",
            "dry friction of {amount} seems to act",
            lambda numpy, _, velocity: numpy.sign(velocity),
            dissipates=True,
            is_sought=True,
        ),
        BuiltIn(
            "cubic",
            "N m/rad^3",
            "the cube of the angle: a hardening spring",
            "the spring seems to harden, by {amount}",
            lambda _, angle, __: angle**3,
            needs_velocity=False,
            angle_period=None,
            spring="beside",
            is_sought=True,
            negative_suspicion="the spring seems to soften: {amount} (so does a pendulum's: then it is 'gravity')",
        ),
        BuiltIn(
            "preload",
            "N m",
            "the sign of the angle: a preload of the spring, or its backlash where it is negative",
            "the spring seems to be preloaded by {amount}",
            lambda numpy, angle, _: numpy.sign(angle),
            needs_velocity=False,
            angle_period=None,
            spring="beside",
            negative_suspicion="the spring seems to have backlash, which changes its torque by {amount}",
        ),
        BuiltIn(
            "gravity",
            "N m",
            "the sine of the angle: a pendulum",
            "gravity of {amount} seems to act",
            lambda numpy, angle, _: numpy.sin(angle),
            needs_velocity=False,
            angle_period=2 * math.pi,
            spring="instead",
            is_sought=True,
        ),
        BuiltIn(
            "viscous_asymmetric",
            "N m s/rad",
            "the magnitude of the velocity: viscous friction that differs between the directions",
            "viscous friction seems to differ between the directions, by {amount}",
            lambda numpy, _, velocity: numpy.abs(velocity),
            is_sought=True,
        ),
        BuiltIn(
            "quadratic_drag",
            "N m s^2/rad^2",
            "the velocity times its magnitude: the drag of a fluid",
            "a drag of {amount} that grows as the square of the velocity seems to act",
            lambda numpy, _, velocity: velocity * numpy.abs(velocity),
            dissipates=True,
            is_sought=True,
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
