"""Choice of the runs for a winding's ends: its own, or those of the paper's winding."""

import math

import numpy as np
import xarray as xr

from calibration.truth import case_of, layout_of
from rodmodel import Layout

#: Windings without fit runs of their own get the ends of this one.
PAPER = Layout("double-helix", 0.0, 3e-3)


def runs_for(truth: xr.Dataset, layout: Layout) -> tuple[Layout, xr.Dataset]:
    """Choose the runs for a layout's ends.

    Parameters
    ----------
    truth : dataset of `gather`.
    layout : layout of the law.

    Returns
    -------
    winding : the layout if there are fit runs of it, else the paper's.
    runs : runs of that winding.
    """
    names = truth["case"].values
    layouts = {name: layout_of(case_of(name).winding) for name in dict.fromkeys(names)}
    for winding in (layout, PAPER):
        own = np.array([_same(winding, layouts[name]) for name in names], dtype=bool)
        if (own & (truth["role"].values == "fit")).any():
            break
    return winding, truth.isel(state=own)


def _same(one: Layout, other: Layout) -> bool:
    if one.psi is None or other.psi is None or one.name != other.name:
        return False
    return math.isclose(one.pitch, other.pitch) and math.isclose(one.psi, other.psi, abs_tol=1e-9)
