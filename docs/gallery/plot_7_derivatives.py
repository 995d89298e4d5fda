"""
Derivatives of noisy samples
============================

Position, velocity and acceleration from noisy samples, window and order chosen, with bands of two standard errors.
"""

import numpy as np

import tvident
from tvident import figures

t = np.arange(1500) / 500
y = np.sin(2 * np.pi * t**2) + 0.05 * np.random.default_rng(0).standard_normal(t.size)
fit = tvident.fit_local_polynomials(y, "auto", sample_rate=500)
figures.plot_derivatives(t, fit, "chirp", samples=y)
