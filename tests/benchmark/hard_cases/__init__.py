"""Twenty recorded hard cases of the finite elements."""

import os

# Read when NumPy and MKL are first imported: on one core sums are the same on every run.
for _name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
