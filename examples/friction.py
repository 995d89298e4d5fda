"""A drive with constant inertia, viscous damping and Coulomb friction, without a spring."""

import numpy as np

import tvident

INERTIA, DAMPING, COULOMB, OFFSET = 0.8, 2.5, 1.5, 0.2

# The motion has three frequencies; the torque follows from it. Both channels are recorded with noise.
t = np.arange(20_000) / 1000
angle, velocity, acceleration = np.zeros(t.size), np.zeros(t.size), np.zeros(t.size)
for amplitude, frequency, phase in ((0.6, 0.5, 0.0), (0.3, 1.3, 1.0), (0.1, 2.9, 2.0)):
    omega = 2 * np.pi * frequency
    angle += amplitude * np.sin(omega * t + phase)
    velocity += amplitude * omega * np.cos(omega * t + phase)
    acceleration -= amplitude * omega**2 * np.sin(omega * t + phase)
torque = INERTIA * acceleration + DAMPING * velocity + COULOMB * np.sign(velocity) + OFFSET
generator = np.random.default_rng(1)
angle += 1e-4 * generator.standard_normal(t.size)
torque += 0.5 * generator.standard_normal(t.size)

result = tvident.identify(
    angle,
    torque,
    sample_rate=1000,
    inertia="constant",
    damping="constant",
    stiffness=0,
    terms=["coulomb", "offset"],
)
truth = {"inertia": INERTIA, "damping": DAMPING, "coulomb": COULOMB, "offset": OFFSET}
for name, (value, error) in result.constants.items():
    print(f"{name:8} {value:.4f} ± {error:.4f}   (truth {truth[name]})")
