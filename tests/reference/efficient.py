"""The estimator that no unbiased one surpasses (Cramér and Rao), linearised around the truth that only a simulation tells."""

import numpy as np
import numpy.typing as npt
from scipy import fft
from scipy.sparse.linalg import LinearOperator, cg

import tvident

Array = npt.NDArray[np.float64]


def efficient_stiffness(rig: tvident.Recording, functions: Array) -> Array:
    """Return the stiffness at every sample as a sum of functions, shape (n, m), beside constant inertia, damping and offset.

    The rows of I θ̈ + C θ̇ + K θ = T have the noise n - D e, where n and e are those of torque and angle and D = I d²/dt² + C d/dt + K, and
    its covariance is V = σ_T² + σ_θ² D Dᵀ. With G the columns of the motion without noise, errors of all factors are
    (Gᵀ V⁻¹ G)⁻¹ Gᵀ V⁻¹ (n - D e). Derivatives are exact for what samples can hold.
    """
    size = rig.time.size
    omega = 2 * np.pi * fft.rfftfreq(size, 1 / rig.sample_rate)
    inertia, damping, stiffness = float(rig.inertia[0]), float(rig.damping[0]), rig.stiffness
    of_angle, of_torque = rig.angle - rig.true_angle, rig.torque - rig.true_torque
    motion = inertia * -(omega**2) + 1j * omega * damping

    def filtered(signal: Array, response: Array) -> Array:
        return np.asarray(fft.irfft(fft.rfft(signal) * response, size))

    def equation(signal: Array) -> Array:
        return filtered(signal, motion) + stiffness * signal

    def covariance(signal: Array) -> Array:
        back = filtered(signal, np.conj(motion)) + stiffness * signal
        return np.asarray(np.var(of_torque) * signal + np.var(of_angle) * equation(back))

    spectrum = np.var(of_torque) + np.var(of_angle) * np.abs(motion + stiffness.mean()) ** 2

    def weighted(signal: Array) -> Array:
        operator = LinearOperator((size, size), covariance)
        about = LinearOperator((size, size), lambda one: filtered(one, 1 / spectrum))
        found, failed = cg(operator, signal, rtol=1e-8, M=about, maxiter=2000)
        assert not failed
        return np.asarray(found)

    columns = np.column_stack(
        [functions * rig.true_angle[:, np.newaxis], rig.true_acceleration, rig.true_velocity, np.ones(size)]
    )
    weights = np.stack([weighted(column) for column in columns.T])
    errors = np.linalg.solve(weights @ columns, weights @ (of_torque - equation(of_angle)))
    return np.asarray(stiffness + functions @ errors[: functions.shape[1]])
