"""Which runs of the full actuator tell of a winding's ends: its own, or those of the paper's winding."""

import math

import numpy as np
import xarray as xr

from calibration.truth import case_of, layout_of
from rodmodel import Layout

#: The winding whose ends those have that no fit run tells of.
PAPER = Layout("double-helix", 0.0, 3e-3)


def runs_for(truth: xr.Dataset, layout: Layout) -> tuple[Layout, xr.Dataset]:
    """Choose the runs that tell of a layout's ends.

    Parameters
    ----------
    truth : of `gather`.
    layout : of the law whose ends are asked for.

    Returns
    -------
    winding : that layout where fit runs of it are there, else the paper's.
    runs : of that winding.
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
