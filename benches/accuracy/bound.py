"""The Cramér-Rao bound: the smallest standard errors that any unbiased estimator can have.

Both channels are noisy: θ + e with variance σ_θ², and T + n with variance σ_T², where T = D(p) θ and D = I d²/dt² + C d/dt + K. The true
angle is unknown at every sample. Taking it out of the Fisher information of angle and parameters leaves

    J = Gᵀ (σ_T² + σ_θ² D Dᵀ)⁻¹ G,    G = ∂(D θ)/∂p,

which for constant parameters is a sum over frequencies: that of the maximum-likelihood estimator in the frequency domain. Where a parameter
changes, its pattern is taken as known up to a factor, so the bound is below what can be reached without that knowledge.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import fft
from scipy.sparse.linalg import LinearOperator, cg

import tvident

Array = npt.NDArray[np.float64]

_TOLERANCE = 1e-8
"""Relative residual of the linear systems: far below the figures that are printed."""


def relative_standard_errors(recording: tvident.Recording, angle_noise: float, torque_noise: float) -> dict[str, float]:
    """Return the bound on the standard errors of stiffness, inertia and damping, each over its mean.

    Parameters
    ----------
    recording : Recording
        Only its truth is used.
    angle_noise, torque_noise : float
        Standard deviations of the two channels' noise, rad and N m.
    """
    motions = {
        "stiffness": recording.true_angle,
        "inertia": recording.true_acceleration,
        "damping": recording.true_velocity,
    }
    columns = np.stack([getattr(recording, name) * motion for name, motion in motions.items()])
    covariance = _Covariance(recording, angle_noise, torque_noise)
    information = columns @ np.stack([covariance.solve(column) for column in columns]).T
    variances = np.diag(np.linalg.inv((information + information.T) / 2))
    return {name: float(np.sqrt(variance)) for name, variance in zip(motions, variances, strict=True)}


class _Covariance:
    """Covariance of the residual of the equation of motion under the true parameters, as an operator."""

    def __init__(self, recording: tvident.Recording, angle_noise: float, torque_noise: float) -> None:
        self._angle, self._torque = angle_noise**2, torque_noise**2
        self._recording = recording
        self._samples = recording.time.size
        self._omega = 2 * np.pi * fft.rfftfreq(self._samples, 1 / recording.sample_rate)
        mean = -recording.inertia.mean() * self._omega**2 + 1j * recording.damping.mean() * self._omega
        self._spectrum = self._torque + self._angle * np.abs(mean + recording.stiffness.mean()) ** 2

    def solve(self, right: Array) -> Array:
        """Return the inverse times a vector, by conjugate gradients preconditioned with that of the mean parameters."""
        shape = (self._samples, self._samples)
        precondition = LinearOperator(shape, lambda v: self._filtered(v.ravel(), 1 / self._spectrum))
        solution, failed = cg(
            LinearOperator(shape, lambda v: self._times(v.ravel())),
            right,
            rtol=_TOLERANCE,
            M=precondition,
            maxiter=2000,
        )
        if failed:
            raise RuntimeError(f"the bound's linear system must converge; it did not in {failed} steps")
        return np.asarray(solution)

    def _times(self, v: Array) -> Array:
        """Return σ_T² v + σ_θ² D Dᵀ v; derivatives are exact for what the samples can hold."""
        r = self._recording
        first, second = 1j * self._omega, -(self._omega**2)
        w = self._filtered(r.inertia * v, second) - self._filtered(r.damping * v, first) + r.stiffness * v
        w = r.inertia * self._filtered(w, second) + r.damping * self._filtered(w, first) + r.stiffness * w
        return self._torque * v + self._angle * w

    def _filtered(self, v: Array, transfer: npt.NDArray[np.number]) -> Array:
        return np.asarray(fft.irfft(transfer * fft.rfft(v), self._samples))
