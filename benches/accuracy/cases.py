"""Kinds of recordings of the simulated rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

import tvident
from tvident._choices import Excitation
from tvident._choices import Pattern as Movement

Array = npt.NDArray[np.float64]
Pattern = Literal["slider", "ramp", "square", "constant", "I and C vary", "I varies by 5 %", "I ramps by 5 %"]

SAMPLE_RATE = 1000.0
FIRST_SEED = 20_000
"""Recordings are numbered from here: seeds that nothing was tuned on."""

INERTIA, DAMPING = 0.0123, 0.00825
"""kg m² and N m s/rad: with K between 10 and 22 N m/rad the damping ratio is about 1 %."""


@dataclass(frozen=True)
class Case:
    """A kind of recording: how parameters move, and how well the two channels were measured.

    Parameters
    ----------
    pattern : str
        How stiffness moves, and whether inertia and damping do.
    angle_noise : float
        Standard deviation of the angle's noise over that of the angle; without an encoder.
    encoder_counts : int, optional
        Counts a turn: the angle is rounded instead of getting noise.
    torque_snr_db : float
        Power of the torque over that of its noise.
    duration : float
        Seconds.
    excitation : str
        Driving torque.
    """

    pattern: Pattern = "slider"
    angle_noise: float = 1e-2
    encoder_counts: int | None = None
    torque_snr_db: float = 20.0
    duration: float = 40.0
    excitation: Excitation = "multisine"

    def key(self) -> dict[str, Any]:
        """Return what tells this case from others."""
        return asdict(self)

    @property
    def angle_label(self) -> str:
        """How well the angle was measured, in a word or two."""
        return (
            f"{self.encoder_counts} counts" if self.encoder_counts else f"{self.angle_noise:.0e}".replace("e-0", "e-")
        )

    def record(self, number: int) -> tvident.Recording:
        """Simulate one of the recordings of this case."""
        movement, inertia, damping = _parameters(self.pattern, self.duration)
        return tvident.simulate_torsional_rig(
            self.duration,
            SAMPLE_RATE,
            FIRST_SEED + number,
            movement,
            self.excitation,
            torque_snr_db=self.torque_snr_db,
            angle_noise=self.angle_noise,
            encoder_counts=self.encoder_counts,
            inertia=inertia,
            damping=damping,
        )

    def noise_levels(self, recording: tvident.Recording) -> tuple[float, float]:
        """Return the standard deviations of the noise of angle and torque; rounding counts as white noise of q²/12."""
        torque = float(recording.true_torque.std()) * 10 ** (-self.torque_snr_db / 20)
        if self.encoder_counts:
            return 2 * np.pi / self.encoder_counts / np.sqrt(12), torque
        return float(recording.true_angle.std()) * self.angle_noise, torque


def _parameters(
    pattern: Pattern,
    duration: float,
) -> tuple[Movement, float | Callable[[Array], Array], float | Callable[[Array], Array]]:
    """Return how the slider moves, and inertia and damping over time."""
    if pattern == "I varies by 5 %":
        return "slider", lambda t: INERTIA * (1 + 0.05 * np.sin(2 * np.pi * 0.1 * t + 0.5)), DAMPING
    if pattern == "I ramps by 5 %":
        # From 5 % below to 5 % above over the whole record: what wears, or is filled, drifts.
        return "slider", lambda t: INERTIA * (1 + 0.05 * (2 * t / duration - 1)), DAMPING
    if pattern == "I and C vary":

        def inertia(t: Array) -> Array:
            return INERTIA * (1 + 0.3 * np.sin(2 * np.pi * 0.1 * t + 0.5))

        def damping(t: Array) -> Array:
            return 3 * DAMPING * (1 + 0.5 * np.sin(2 * np.pi * 0.07 * t + 1))

        return "slider", inertia, damping
    return pattern, INERTIA, DAMPING
