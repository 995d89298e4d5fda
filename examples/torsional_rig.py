"""Inertia, damping and stiffness of a rig whose stiffness changes, with and without knowing the inertia."""

import numpy as np

import tvident

rig = tvident.simulate_torsional_rig(duration=20.0, sample_rate=1000.0, angle_noise=1e-3)


def error(result: tvident.Identification) -> float:
    """Return the rms error of the stiffness over its mean."""
    return float(np.sqrt(np.nanmean((result.stiffness - rig.stiffness) ** 2)) / rig.stiffness.mean())


unknown = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate)
print(unknown.summary(), end="\n\n")
print(f"nothing known:     stiffness within {error(unknown):.1%}, condition {np.nanmedian(unknown.condition):.0f}")

# Inertia and stiffness look alike over one cycle of vibration. A disk can be weighed: give its inertia.
known = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, inertia=0.0123)
print(f"inertia known:     stiffness within {error(known):.1%}, condition {np.nanmedian(known.condition):.0f}")

frequency, deviation = known.natural_frequency, known.stderr["natural_frequency"]
for second in (5, 10, 15):
    i = second * 1000
    print(f"natural frequency after {second:2d} s: {frequency[i]:.3f} ± {deviation[i]:.3f} Hz")
known.save("torsional-rig.csv")
