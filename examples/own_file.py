"""From a file to a file: ``python own_file.py recording.csv``. Without a file it makes one first."""

import sys

import numpy as np

import tvident
from tvident import recordings

if len(sys.argv) > 1:
    path = sys.argv[1]
else:
    path = "recording.csv"
    tvident.simulate_torsional_rig(duration=10.0).save(path)

channels = recordings.read(path)  # text columns, NPY, NPZ or MATLAB
print(f"{path} holds {', '.join(channels)}")
time = recordings.channel(channels, "time", path)
angle = recordings.channel(channels, "angle", path)
torque = recordings.channel(channels, "torque", path)

# A missing sample is NaN: only the equations that contain it are left out. Here 19 ms are missing.
angle[4001:4020] = np.nan

result = tvident.identify(angle, torque, t=time)
bridged = result.status & tvident.Status.GAP != 0
print(result.summary())
print(f"{bridged.sum()} samples around the gap have results from before and after it")

result.save("identified.npz")
result.plot().savefig("identified.png")
