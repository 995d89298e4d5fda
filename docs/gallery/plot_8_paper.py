"""
The paper's figures
===================

Figures 2, 4, 5 and 6 of Ruzek, Chesné and Rémond: the recording, a window with the order that Akaike's criterion takes, the same with
noise, and inertia, damping and stiffness.
"""

import tvident
from tvident import figures

recording = tvident.simulate_torsional_rig()
figures.paper_figure_2(recording)

# %%
# A window without noise takes a high order:

figures.paper_figure_4(recording)

# %%
# With noise of 5 % a lower one:

figures.paper_figure_5(recording)

# %%
# The paper's settings, with the error below each parameter:

result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
figures.paper_figure_6(result, recording)
