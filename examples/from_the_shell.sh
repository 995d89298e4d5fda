#!/bin/sh
# From a recording to parameters without Python. Writes its files to the current folder.
set -eu

# A recording: ten seconds of the simulated rig. Put your own file in its place.
tvident simulate rig.csv --duration 10 --seed 4

# Its channels.
tvident info rig.csv

# The angle's velocity and acceleration, with errors, order and status; every tenth sample.
tvident derivatives rig.csv --channel angle --time time --window-length '0.2 s' --step 10 -o derivatives.csv

# Inertia, damping and stiffness at every sample, with settings chosen from the recording.
tvident identify rig.csv --angle angle --torque torque --time time -o result.csv --plot result.png

# The same with the inertia known, as NPZ; and a look at the first lines of the result.
tvident identify rig.csv --angle angle --torque torque --time time --inertia 0.0123 -o known.npz
tvident identify rig.csv --angle angle --torque torque --time time --inertia 0.0123 --step 100 -o - 2> /dev/null | cut -d, -f1,6,7 | tail -n 5
