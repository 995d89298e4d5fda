"""How fast the library is beside its peers: ``make bench``, or ``python -m speed --help`` from this folder."""

import os

# One thread for everybody. Libraries read these when they are imported, so they are set before anything else.
for _name in (
    "MKL_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "POLARS_MAX_THREADS",
    "RAYON_NUM_THREADS",
    "TVIDENT_WORKERS",
):
    os.environ[_name] = "1"
