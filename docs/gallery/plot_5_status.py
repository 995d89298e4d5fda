"""
Order and status over time
==========================

Which order the paper's method takes in each window, and where values deserve a second look.
"""

import tvident

recording = tvident.simulate_torsional_rig()
result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
result.plot("status")
