"""
Poles, natural frequency and damping ratio
==========================================

Each sample's system as if it stayed as it is then.
"""

import tvident

recording = tvident.simulate_torsional_rig()
result = tvident.identify(recording.angle, recording.torque, sample_rate=1000)
result.plot("poles")
