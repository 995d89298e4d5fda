"""
Does the model hold? Recorded and predicted torque
==================================================

What is left should look like noise. A residual that follows the motion says what the equation lacks: here dry friction, which is there in
the second picture.
"""

import numpy as np

import tvident

generator = np.random.default_rng(0)
t = np.arange(8000) / 1000
angle = np.sin(7 * t) + 0.3 * np.sin(23 * t)
velocity, acceleration = np.gradient(angle, t), np.gradient(np.gradient(angle, t), t)
torque = 0.02 * acceleration + 0.1 * velocity + 0.5 * np.sign(velocity) + 0.02 * generator.standard_normal(t.size)

without = tvident.identify(angle, torque, sample_rate=1000, stiffness=0)
without.plot("torque")

# %%
# With friction in the equation noise is left:

friction = tvident.identify(angle, torque, sample_rate=1000, stiffness=0, terms=["coulomb"])
friction.plot("torque")
