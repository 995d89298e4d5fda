"""
Stiffness over a position
=========================

Where a parameter depends on a position alone, all passes lie on one curve; colour is time.
"""

import tvident

recording = tvident.simulate_torsional_rig()
result = tvident.identify(recording.angle, recording.torque, sample_rate=1000)
result.plot("over", position=recording.slider_position, label="slider position (m)")
