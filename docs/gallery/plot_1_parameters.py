"""
Parameters over time
====================

What changes has a panel with a band of two standard errors; what is constant is a line of text. Beside a simulated truth stands the error,
with the band that should hold it.
"""

import tvident

recording = tvident.simulate_torsional_rig()
result = tvident.identify(recording.angle, recording.torque, sample_rate=1000)
result.plot(truth=recording)
