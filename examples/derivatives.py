"""Velocity and acceleration of a noisy recording."""

import numpy as np

import tvident

# Two seconds of an oscillation with increasing frequency, 500 samples per second, with noise.
sample_rate = 500.0
t = np.arange(1000) / sample_rate
phase = 2 * np.pi * (1.0 * t + 0.75 * t**2)
rate = 2 * np.pi * (1.0 + 1.5 * t)
true_acceleration = 0.4 * (3 * np.pi * np.cos(phase) - rate**2 * np.sin(phase))
angle = 0.4 * np.sin(phase) + 2e-3 * np.random.default_rng(0).standard_normal(t.size)

fit = tvident.fit_local_polynomials(angle, "0.25 s", sample_rate=sample_rate)
smooth, velocity, acceleration = fit.derivatives

print(f"noise: {np.median(fit.sigma):.4f} rad (it is 0.0020)")
orders, counts = np.unique(fit.order, return_counts=True)
print("orders: " + ", ".join(f"{order} in {count / t.size:.0%}" for order, count in zip(orders, counts, strict=True)))

# Near the ends, windows are evaluated off their centres and errors are larger: these samples have the flag EDGE.
inside = fit.status & tvident.Status.EDGE == 0
error = np.sqrt(np.mean((acceleration - true_acceleration)[inside] ** 2)) / true_acceleration.std()
plain = np.gradient(np.gradient(angle, t), t)
plain_error = np.sqrt(np.mean((plain - true_acceleration)[inside] ** 2)) / true_acceleration.std()
print(f"error of the acceleration: {error:.1%} (differences of neighbouring samples: {plain_error:.0%})")
