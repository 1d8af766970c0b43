"""Stiff ends of an actuator: how much of the body does not bend near base and cap, from full-actuator runs.

Near its ends the section cannot widen freely, and bends less. Seen from a few diameters away, that is as if
parts of the body did not bend at all: an arc of the cell's free curvature between two straight pieces. Their
lengths are fitted to the tip's pose on the ``fit`` runs without loads, to its position and to that of a point
half a body's length ahead of it; the curvature is that of the cell on the same mesh, so that neither the mesh
nor the law's error goes into them.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from calibration.truth import TruthError, case_of, free_states
from fem_reference import Load, PeriodCell, follow

_MM = 1e-3


@dataclass(frozen=True)
class StiffEnds:
    """Fitted lengths, and how well they do.

    Parameters
    ----------
    base, tip : lengths that do not bend [m]; standard_errors : of the two [m].
    before, after : root mean square of the tip's distance from that of the arc, without and with them [m].
    turn_before, turn_after : the same of the angle between the caps' axes [rad].
    states : how many they were fitted to.
    """

    base: float
    tip: float
    standard_errors: tuple[float, float]
    before: float
    after: float
    turn_before: float
    turn_after: float
    states: int


def fit_ends(truth: xr.Dataset, body_length: float, cap_length: float) -> StiffEnds:
    """Fit the lengths to the unloaded states of the ``fit`` runs.

    Parameters
    ----------
    truth : of `gather`.
    body_length, cap_length : of the actuator [m].

    Raises
    ------
    TruthError
        Where the truth has no such state.
    """
    chosen = truth.isel(state=free_states(truth) & (truth["role"].values == "fit"))
    if chosen.sizes["state"] == 0:
        raise TruthError("truth: got no unloaded state of a fit run, expected some to fit the ends to")
    curvature = cell_curvatures(chosen)
    tip, axis = chosen["tip_position"].values, chosen["tip_rotation"].values[:, :, 2]
    ahead = 0.5 * body_length

    def misses(ends: Float[np.ndarray, "2"]) -> tuple[np.ndarray, np.ndarray]:
        """Of the tip's position [m] and of the cap's axis."""
        position, along = tip_between_ends(curvature, body_length, cap_length, *(_MM * ends))
        return position - tip, along - axis

    def residual(ends: Float[np.ndarray, "2"]) -> np.ndarray:
        place, along = misses(ends)
        return np.concatenate([place, place + ahead * along]).ravel() / _MM

    found = least_squares(residual, np.zeros(2), x_scale=0.1)
    left = found.fun.size - 2
    covariance = np.linalg.inv(found.jac.T @ found.jac) * (found.fun @ found.fun) / left
    (before, turn_before), (after, turn_after) = (
        tuple(_root_mean_square(part) for part in misses(ends)) for ends in (np.zeros(2), found.x)
    )
    first, second = _MM * np.sqrt(np.diag(covariance))
    base, end = _MM * found.x
    return StiffEnds(
        base=float(base),
        tip=float(end),
        standard_errors=(float(first), float(second)),
        before=before,
        after=after,
        turn_before=turn_before,
        turn_after=turn_after,
        states=chosen.sizes["state"],
    )


def _root_mean_square(vectors: Float[np.ndarray, "n 3"]) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def tip_between_ends(
    curvature: Float[np.ndarray, "n 3"], body_length: float, cap_length: float, base: float, tip: float
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Centre of the cap's outer face [m], and the cap's axis, of arcs between straight ends.

    Parameters
    ----------
    curvature : of the arcs [1/m].
    body_length, cap_length : of the actuator [m].
    base, tip : parts of the body that do not bend [m].
    """
    turn = curvature * (body_length - base - tip)
    end = Rotation.from_rotvec(turn).as_matrix()
    # ∫ exp(û s) ds over the arc, by Gauss's rule of 20 points, exact to rounding up to a full turn.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    along = np.zeros_like(curvature)
    for node, weight in zip(0.5 * (nodes + 1.0), 0.5 * weights, strict=True):
        along += weight * Rotation.from_rotvec(node * turn).as_matrix()[:, :, 2]
    arc = (body_length - base - tip) * along
    return np.array([0.0, 0.0, base]) + arc + (tip + cap_length) * end[:, :, 2], end[:, :, 2]


def cell_curvatures(states: xr.Dataset) -> Float[np.ndarray, "n 3"]:
    """Free curvature of the period cell at the pressures of unloaded states, case by case [1/m]."""
    names = states["case"].values
    curvature = np.zeros((len(names), 3))
    for name in dict.fromkeys(names):
        own = np.flatnonzero(names == name)
        loads = [Load((float(p), float(q), float(r))) for p, q, r in states["pressure"].values[own]]
        cell = PeriodCell(winding=case_of(name).winding, level=states.attrs["mesh"])
        curvature[own] = [state.curvature for state in follow(cell, loads)]
    return curvature
