"""What a torque at some frequencies tells of inertia, damping and stiffness: Fisher's information of the rows, and where to put power."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_ROUNDS = 400
"""Of moving power to where it tells most: the last move less than a thousandth of it."""

_OTHERS = 0.05
"""What relative variances of inertia and damping count beside that of the stiffness."""


@dataclass(frozen=True)
class Guess:
    """A guess of the system and its noise.

    Parameters
    ----------
    parameters : ndarray, shape (3,)
        Inertia, damping and stiffness.
    noise : (float, float)
        Standard deviations of angle and torque.
    """

    parameters: Array
    noise: tuple[float, float]

    def impedance(self, frequencies: Array) -> npt.NDArray[np.complex128]:
        """Return torque over angle."""
        s = 2j * np.pi * frequencies
        inertia, damping, stiffness = self.parameters
        return np.asarray(inertia * s**2 + damping * s + stiffness, np.complex128)

    def information(self, frequencies: Array) -> Array:
        """Return what one sample tells of the parameters, for a torque of mean square one at each frequency, shape (f, 3, 3).

        A row at one frequency is T = Z θ, its noise that of the torque and Z times that of the angle. Its slopes by the parameters
        are θ times s², s and 1.
        """
        s = 2j * np.pi * frequencies
        slopes = np.stack([s**2, s, np.ones_like(s)], axis=1)
        size = np.abs(self.impedance(frequencies)) ** 2
        noise = self.noise[1] ** 2 + size * self.noise[0] ** 2
        products = np.real(slopes[:, :, np.newaxis] * np.conj(slopes[:, np.newaxis, :]))
        return np.asarray(products / (size * noise)[:, np.newaxis, np.newaxis])


def variances(information: Array, samples: float, window: float | None) -> Array:
    """Return variances of inertia, damping and stiffness, of which the stiffness belongs to windows of so many samples.

    Parameters
    ----------
    information : ndarray, shape (3, 3)
        Of one sample.
    samples : float
    window : float or None
        None where the stiffness is constant.
    """
    if window is None or window >= samples:
        return np.asarray(np.diag(_inverse(information * samples)))
    constants = slice(0, 2)
    across, own = information[constants, 2], information[2, 2]
    rest = information[constants, constants] - np.outer(across, across) / own
    covariance = _inverse(rest * samples)
    passed_on = across @ covariance @ across / own**2
    return np.array([*np.diag(covariance), 1 / (window * own) + passed_on])


def _inverse(information: Array) -> Array:
    """Return the covariance that information gives."""
    try:
        return np.asarray(np.linalg.inv(information))
    except np.linalg.LinAlgError:
        raise ValueError(
            "a plan needs parameters that a torque tells apart; got some that are far too small or large beside the others; "
            "check the units of inertia=, damping=, stiffness= and band="
        ) from None


def best_powers(information: Array, parameters: Array) -> Array:
    """Return the share of the power at every frequency that makes relative variances smallest, of the stiffness above all.

    Shares grow with what they gain (the multiplicative algorithm of optimal design).
    """
    weight = np.array([_OTHERS, _OTHERS, 1.0]) / parameters**2
    share = np.full(len(information), 1 / len(information))
    for _ in range(_ROUNDS):
        inverse = _inverse(np.einsum("f,fij->ij", share, information))
        gain = np.einsum("i,ij,fjk,ki->f", weight, inverse, information, inverse)
        share = share * np.sqrt(gain)
        share /= share.sum()
    return np.asarray(share)
