"""
Do equations of every scale agree?
==================================

A wide test function asks the equation to hold for slow motion only, a narrow one for fast motion too. Where a recording obeys it, all
widths find the same.
"""

import tvident

recording = tvident.simulate_torsional_rig()
result = tvident.identify(recording.angle, recording.torque, sample_rate=1000)
result.plot("scan")
