"""Fit of an actuator's ends to runs of the full actuator: their compliance, and the poses of body and cap.

All numbers are fitted to the unloaded states of the ``fit`` runs only. First the axial compliance of the
ends: with it the cell has the curvature of the actuator's middle. Then, with the cell of that compliance,
six numbers of `rodmodel.Actuator` fit the arc to the tip's pose: its position, and that of a point half a
body's length ahead of it. A seventh fits the cell's chamber volumes to the actuator's. The base acts by a
moment; the rotation follows from the cell's stiffness, relative to the stiffness at rest. The cell has
the mesh of the runs, so that neither the mesh nor the error of a law affects the numbers.
"""

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from calibration.ends.cell_bending import Bending, cell_bending, design_of
from calibration.truth import TruthError, free_states
from fem_reference.geometry import Units
from rodmodel.statics import BENDING_AXES

#: Fitted parameters, by the names of `rodmodel.Actuator`, with their units in the search: in the body's own
#: millimetres and megapascals (`Units`).
PARAMETERS = {
    "base_turn": 1.0,
    "base_lag": 1.0,
    "stiff_tip": 1.0,
    "tip_offset": 1.0,
    "tip_offset_curvature": 5e-3,
    "base_growth": 1.0,
}
#: `rodmodel.Actuator.tip_draw` in the body's own mm³. Runs of small bends do not tell it, so all designs have
#: that of the paper's actuator at ψ = 0: its 50 fit states leave 17.2 mm² without, 15.1 mm² with it.
DRAW = 710.0
# Bounds of the search, in these units: few states of small curvature tell the cap's offset by its slope
# alone, and would take both numbers of it to infinity. An offset is at most half of the diameter.
_LEAST = np.array([-50.0, -30.0, 0.0, -6.0, 0.1, 0.0])
_MOST = np.array([50.0, 30.0, 30.0, 6.0, 40.0, 1.0])
# Starts of the search: near the paper's ends; and no ends, so that none fit worse than those.
_STARTS = np.ones(len(PARAMETERS)), np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Compliance:
    """Compliance of the ends along the rod.

    Parameters
    ----------
    value, standard_error : compliance and its standard error [m/N].
    before, after : root mean square difference of bending angle between the cell and the actuator's middle,
        over a body's length, with rigid and with compliant ends [rad].
    states : number of fitted states.
    """

    value: float
    standard_error: float
    before: float
    after: float
    states: int


@dataclass(frozen=True)
class Ends:
    """Fitted ends and their errors.

    Parameters
    ----------
    values, standard_errors : fitted values and standard errors, by the names of `rodmodel.Actuator` [SI].
    before, after : root mean square error of the tip position, without and with the ends [m].
    turn_before, turn_after : root mean square angle between the caps' axes, likewise [rad].
    volume_before, volume_after : root mean square error of a chamber's volume, likewise [m³].
    angle_median, angle_p90, angle_worst : median, 90th percentile and worst error of the bending angle in
        leave-one-run-out cross-validation [rad].
    states : number of fitted states.
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    before: float
    after: float
    turn_before: float
    turn_after: float
    volume_before: float
    volume_after: float
    angle_median: float
    angle_p90: float
    angle_worst: float
    states: int


def fit_compliance(truth: xr.Dataset, body_length: float, trial: float) -> Compliance:
    """Fit the compliance of the ends to the curvature in the middle of the actuator.

    The cell's curvature per length of the rod is linearised in the compliance, which is accurate to some
    percent of the change; so ``trial`` should be near the result.

    Parameters
    ----------
    truth : runs of one winding.
    body_length : body length of the actuator [m].
    trial : compliance at which the cell is computed, besides zero [m/N].

    Raises
    ------
    TruthError
        If the truth has no unloaded state of a fit run.
    """
    chosen = _fit_states(truth)
    middle = body_length * chosen["middle_curvature"].values
    rigid, compliant = (body_length * _per_rod(cell_bending(chosen, c)) for c in (0.0, trial))
    slope, gap = (compliant - rigid)[:, :2].ravel(), (middle - rigid)[:, :2].ravel()
    share = float(slope @ gap / (slope @ slope))
    residual = gap - share * slope
    variance = float(residual @ residual) / max(len(gap) - 1, 1)
    count = chosen.sizes["state"]
    return Compliance(
        value=share * trial,
        standard_error=float(np.sqrt(variance / (slope @ slope))) * trial,
        before=float(np.sqrt(gap @ gap / count)),
        after=float(np.sqrt(residual @ residual / count)),
        states=count,
    )


def fit_shear(truth: xr.Dataset) -> tuple[float, float] | None:
    """Fit the shear compliance of the sections to loaded states of ``fit`` runs.

    Parameters
    ----------
    truth : dataset of `gather`.

    Returns
    -------
    compliance, standard_error : shear angle per transverse force and its standard error [1/N]; None if no
        such state has its sections' frames.
    """
    forced = truth["tip_force"].values.any(axis=1) & np.isfinite(truth["middle_shear"].values).all(axis=1)
    chosen = truth.isel(state=np.flatnonzero(forced & (truth["role"].values == "fit")))
    if chosen.sizes["state"] == 0:
        return None
    force, lean = chosen["middle_force"].values.ravel(), chosen["middle_shear"].values.ravel()
    value = float(force @ lean / (force @ force))
    residual = lean - value * force
    return value, float(np.sqrt(residual @ residual / (len(force) - 1) / (force @ force)))


def fit_ends(truth: xr.Dataset, body_length: float, cap_length: float, compliance: float) -> Ends:
    """Fit the ends to the unloaded states of the ``fit`` runs.

    Parameters
    ----------
    truth : runs of one winding.
    body_length, cap_length : body and cap length of the actuator [m].
    compliance : compliance of the ends in the cell [m/N].

    Raises
    ------
    TruthError
        If the truth has no such state.
    """
    chosen = _fit_states(truth)
    cell = cell_bending(chosen, compliance)
    held, held_error, *volumes = _held_length(body_length, cell.volume, chosen["volume"].values)
    at_rest = float(np.trace(cell.stiffness[0, :2, :2])) / 2.0
    actuator = _Poses(
        cell.curvature,
        chosen["pressure"].values,
        at_rest * np.linalg.pinv(cell.stiffness[1:]),
        chosen["tip_position"].values,
        chosen["tip_rotation"].values[:, :, 2],
        body_length,
        cap_length,
        design_of(chosen).units,
    )
    units = actuator.scales
    x, fun, jac = _least_squares(actuator)
    variance = fun @ fun / (fun.size - x.size)
    errors = units * np.sqrt(np.diag(np.linalg.inv(jac.T @ jac)) * variance)
    none = units * _STARTS[1]
    (before, turn_before), (after, turn_after) = (
        tuple(_root_mean_square(part) for part in actuator.misses(values)) for values in (none, units * x)
    )
    names = chosen["case"].values
    unseen = np.zeros(len(names))
    for name in dict.fromkeys(names):
        left_out = names == name
        others, *_ = _least_squares(actuator.where(~left_out))
        unseen[left_out] = actuator.where(left_out).angle_errors(units * others)
    return Ends(
        values={
            **dict(zip(PARAMETERS, (units * x).tolist(), strict=True)),
            "base_stiffness": at_rest,
            "tip_draw": actuator.draw,
            "held_length": held,
        },
        standard_errors={**dict(zip(PARAMETERS, errors.tolist(), strict=True)), "held_length": held_error},
        before=before,
        after=after,
        turn_before=turn_before,
        turn_after=turn_after,
        volume_before=volumes[0],
        volume_after=volumes[1],
        angle_median=float(np.median(unseen)),
        angle_p90=float(np.percentile(unseen, 90, method="higher")),
        angle_worst=float(unseen.max()),
        states=chosen.sizes["state"],
    )


def _held_length(
    body_length: float, cell: Float[np.ndarray, "cells 3"], actuator: Float[np.ndarray, "states 3"]
) -> tuple[float, float, float, float]:
    """Return the held length, its standard error [m], and root mean square volume errors [m³].

    Over the held length the ends keep the chambers in their rest shape. What is left grows with the change of
    the volumes, so the square of a state's error counts by one over its change. ``cell`` has volumes per
    length, at rest and then at the states [m²]; ``actuator`` has volumes at the states [m³].
    """
    change = body_length * (cell[1:] - cell[0])
    excess = body_length * cell[1:] - actuator
    weight = 1.0 / np.linalg.norm(change, axis=1, keepdims=True)
    scale = float(np.sum(weight * change**2))
    share = float(np.sum(weight * change * excess)) / scale
    residual = excess - share * change
    error = float(np.sqrt(np.sum(weight * residual**2) / (residual.size - 1) / scale))
    before, after = (float(np.sqrt(np.mean(part**2))) for part in (excess, residual))
    return share * body_length, error * body_length, before, after


@dataclass(frozen=True)
class _Poses:
    """Response of the cell, and pose of the actuator's cap, at each state.

    Parameters
    ----------
    curvature : curvature of the cell [1/m].
    pressure : pressures [Pa].
    softness : bending compliance of the cell, relative to that at rest.
    tip, axis : position [m] and axis of the cap.
    body_length, cap_length : lengths of the actuator [m].
    units : of the body.
    """

    curvature: Float[np.ndarray, "n 3"]
    pressure: Float[np.ndarray, "n 3"]
    softness: Float[np.ndarray, "n 3 3"]
    tip: Float[np.ndarray, "n 3"]
    axis: Float[np.ndarray, "n 3"]
    body_length: float
    cap_length: float
    units: Units

    @property
    def scales(self) -> Float[np.ndarray, " m"]:
        """Units of `PARAMETERS` in the search [SI]."""
        millimetre, pascal = self.units.millimetre, self.units.megapascal
        one = {
            "base_turn": 1.0 / pascal,
            "base_lag": millimetre,
            "stiff_tip": millimetre,
            "tip_offset": millimetre,
            "tip_offset_curvature": 1.0 / millimetre,
            "base_growth": 1.0,
        }
        return np.array([share * one[name] for name, share in PARAMETERS.items()])

    @property
    def draw(self) -> float:
        """Draw of the cap [m³]."""
        return DRAW * self.units.millimetre**3

    def where(self, chosen: Bool[np.ndarray, " n"]) -> "_Poses":
        """Return the chosen states."""
        return replace(
            self,
            curvature=self.curvature[chosen],
            pressure=self.pressure[chosen],
            softness=self.softness[chosen],
            tip=self.tip[chosen],
            axis=self.axis[chosen],
        )

    def misses(self, values: Float[np.ndarray, " m"]) -> tuple[np.ndarray, np.ndarray]:
        """Return the errors of tip position [m] and cap axis, with ends of these values."""
        named = dict(zip(PARAMETERS, values.tolist(), strict=True))
        position, along = tip_between_ends(
            self.curvature,
            self.pressure,
            self.softness,
            self.body_length,
            self.cap_length,
            tip_draw=self.draw,
            **named,
        )
        return position - self.tip, along - self.axis

    def angle_errors(self, values: Float[np.ndarray, " m"]) -> Float[np.ndarray, " n"]:
        """Return the errors of the bending angle [rad]."""
        _, missed = self.misses(values)
        ours, theirs = ((axis[:, 2]).clip(-1.0, 1.0) for axis in (self.axis + missed, self.axis))
        return np.asarray(np.abs(np.arccos(ours) - np.arccos(theirs)))


def _least_squares(poses: _Poses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the best values in the units of `PARAMETERS`, the residuals and their Jacobian."""
    units = poses.scales

    def residual(x: Float[np.ndarray, " m"]) -> np.ndarray:
        place, along = poses.misses(units * x)
        return (
            np.concatenate([place, place + 0.5 * poses.body_length * along]).ravel() / poses.units.millimetre
        )

    tried = [least_squares(residual, start, bounds=(_LEAST, _MOST)) for start in _STARTS]
    found = min(tried, key=lambda one: float(one.cost))
    return found.x, found.fun, found.jac


def tip_between_ends(
    curvature: Float[np.ndarray, "n 3"],
    pressure: Float[np.ndarray, "n 3"],
    softness: Float[np.ndarray, "n 3 3"],
    body_length: float,
    cap_length: float,
    base_turn: float,
    base_lag: float,
    stiff_tip: float,
    tip_offset: float,
    tip_offset_curvature: float,
    base_growth: float,
    tip_draw: float,
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Return the centre of the cap's outer face [m] and the cap's axis, for arcs between ends.

    Parameters
    ----------
    curvature : curvatures of the arcs [1/m].
    pressure : chamber pressures [Pa].
    softness : compliance of the section times the bending stiffness to which ``base_turn`` and ``base_lag``
        refer.
    body_length, cap_length : lengths of the actuator [m].
    base_turn, base_lag, stiff_tip, tip_offset, tip_offset_curvature, base_growth, tip_draw : see
        `rodmodel.Actuator`.
    """
    turn = curvature * (body_length - stiff_tip)
    end = Rotation.from_rotvec(turn).as_matrix()
    # ∫ exp(û s) ds over the arc by 20-point Gauss quadrature, exact to round-off up to a full turn.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    along = np.zeros_like(curvature)
    for node, weight in zip(0.5 * (nodes + 1.0), 0.5 * weights, strict=True):
        along += weight * Rotation.from_rotvec(node * turn).as_matrix()[:, :, 2]
    arc = (body_length - stiff_tip) * along
    away = np.stack([-curvature[:, 1], curvature[:, 0], 0.0 * curvature[:, 0]], axis=1)
    away *= (tip_offset / np.sqrt(tip_offset_curvature**2 + (away**2).sum(axis=1)))[:, None]
    away[:, 2] = -tip_draw * (curvature[:, :2] ** 2).sum(axis=1)
    position = arc + np.einsum("nij,nj->ni", end, away)
    position += (stiff_tip + cap_length) * end[:, :, 2]
    bend = curvature * [1.0, 1.0, 0.0]
    held_back = base_turn * pressure @ BENDING_AXES - base_lag * bend
    once = _softened(softness, held_back)
    twice = _softened(softness, once)
    base = Rotation.from_rotvec(once + base_growth * (twice - once))
    return base.apply(position), base.apply(end[:, :, 2])


def _softened(
    softness: Float[np.ndarray, "n 3 3"], turn: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    return np.asarray(np.einsum("nij,nj->ni", softness, turn) * [1.0, 1.0, 0.0])


def _per_rod(cell: Bending) -> Float[np.ndarray, "n 3"]:
    """Return the curvature per length of the rod, along which the silicone slides [1/m]."""
    return cell.curvature / cell.stretch[:, None]


def _fit_states(truth: xr.Dataset) -> xr.Dataset:
    chosen = truth.isel(state=free_states(truth) & (truth["role"].values == "fit"))
    if chosen.sizes["state"] == 0:
        raise TruthError(
            "truth: got no unloaded state of a fit run, expected at least one to fit the ends to"
        )
    return chosen


def _root_mean_square(vectors: Float[np.ndarray, "n 3"]) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
