"""The cell at the pressures of runs of the full actuator: what the body does between its ends."""

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from jaxtyping import Float

from calibration.truth import case_of, truth_level
from fem_reference import CellState, Design, Load, PeriodCell, follow, parse_design


@dataclass(frozen=True)
class Bending:
    """Response of the cell to pressures without moments.

    Parameters
    ----------
    curvature : curvature at each state [1/m].
    stretch : stretch of the silicone along the rod at each state.
    volume : volume of each chamber per length, at rest and then at the states [m²].
    stiffness : ∂²Π/∂u², at rest and then at the states [N m²]; of a cell that keeps its plane, in the plane.
    """

    curvature: Float[np.ndarray, "n 3"]
    stretch: Float[np.ndarray, " n"]
    volume: Float[np.ndarray, "n+1 3"]
    stiffness: Float[np.ndarray, "n+1 3 3"]


def cell_bending(states: xr.Dataset, compliance: float) -> Bending:
    """Compute the cell at the pressures of unloaded states, with an end compliance [m/N]."""
    names = states["case"].values
    found: dict[int, CellState] = {}
    for name in dict.fromkeys(names):
        own = np.flatnonzero(names == name)
        loads = [Load((float(p), float(q), float(r))) for p, q, r in states["pressure"].values[own]]
        level = truth_level(states, str(name))
        design = design_of(states)
        if "design" not in states.attrs:
            design = replace(design, winding=case_of(name).winding)
        # A free cell leaves its plane at a lower pressure than the actuator, if this leaves it at all.
        in_plane = design.mirror_in_place and all(load.in_plane for load in loads)
        cell = PeriodCell.of(design, level, compliance, symmetric=in_plane)
        found.update(zip(own, follow(cell, loads), strict=True))
    (rest,) = follow(PeriodCell.of(design, level, compliance), [Load((0.0, 0.0, 0.0))])
    ordered = [found[row] for row in range(len(names))]
    return Bending(
        curvature=np.array([s.curvature for s in ordered]),
        stretch=np.array([s.stretch for s in ordered]),
        volume=np.array([s.volume for s in (rest, *ordered)]),
        stiffness=np.array([s.hessian[:3, :3] for s in (rest, *ordered)]),
    )


def design_of(truth: xr.Dataset) -> Design:
    """Return the actuator of runs; those that name none are of the paper's, in several windings."""
    text = truth.attrs.get("design")
    return Design() if text is None else parse_design(str(text), "truth: design")
