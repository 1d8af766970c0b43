"""Former place of `plot_rod`, kept for one release; it is in `rodmodel.view`."""

import warnings

from rodmodel.view import plot_rod as plot_rod

warnings.warn(
    "rodmodel.plot leaves in the next release: import plot_rod from rodmodel.view",
    DeprecationWarning,
    stacklevel=2,
)
