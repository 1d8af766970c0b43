"""The tip under pressures and loads, with its derivatives, in one kernel: what a control loop asks for."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel._balance import Equilibrium
from rodmodel._bending import bending
from rodmodel._components import Quaternion, solve, triple, turn_by
from rodmodel._ends import base_turn, cap_centre, product, tip_offset
from rodmodel._equilibria import FixedStep
from rodmodel._follow import CONVERGED, follow
from rodmodel._kernel import one_kernel
from rodmodel._loads import Resultants, mounted
from rodmodel._march import march
from rodmodel._rotation import rotation_of
from rodmodel.calibration_file import Actuator
from rodmodel.section import CurvatureLaw, SectionLaw

_TOLERANCE = 1e-7


class Tip(NamedTuple):
    """Pose of the cap in the frame of the base, and how it was found."""

    position: Float[Array, "3"]
    """Centre of the cap's outer face [m]."""
    rotation: Float[Array, "3 3"]
    angle: Float[Array, ""]
    """θ [rad]."""
    plane: Float[Array, ""]
    """γ [rad]."""
    unknown: Float[Array, "3"]
    """A start for the next solve."""
    converged: Bool[Array, ""]
    stable: Bool[Array, ""]


class TipChange(NamedTuple):
    """Derivatives of a tip by the three pressures and the tip force, as columns."""

    position: Float[Array, "3 6"]
    """[m/Pa] and [m/N]"""
    turn: Float[Array, "3 6"]
    """Of the small turn of the cap, δR = (turn × R) [rad/Pa] and [rad/N]."""


def solve_and_differentiate_tip(
    section: SectionLaw,
    actuator: Actuator,
    loads: Resultants,
    solver: FixedStep,
    pressure: Float[Array, "3"],
    start: Float[Array, "3"],
) -> tuple[Tip, TipChange]:
    """Solve a rod with fixed steps, and differentiate them, in one kernel but for the law at the pressures.

    Parameters
    ----------
    section, actuator : of the rod.
    loads : in the frame of the base.
    solver : its tolerance is 1e-7 where it has none.
    pressure : of the chambers [Pa].
    start : `unknown` of a tip nearby; NaN for none.
    """

    def found(law: Any, by_pressure: Any, pressure: Any, loads: Any, start: Any) -> tuple[Tip, TipChange]:
        tip = tip_of(law, actuator, loads, solver, pressure, start)
        return tip, change_of(law, by_pressure, actuator, loads, pressure, tip.unknown, solver.steps)

    law, by_pressure = section.at(pressure), jax.jacfwd(section.at)(pressure)
    answer: tuple[Tip, TipChange] = one_kernel(found, law, by_pressure, pressure, loads, start)
    return answer


def tip_of(
    law: CurvatureLaw, actuator: Actuator, loads: Resultants, solver: FixedStep, pressure: Any, start: Any
) -> Tip:
    """Solve with fixed steps, within a kernel; see `solve_and_differentiate_tip`."""
    equilibrium, mount = _mounted(actuator, law, pressure, loads)
    tolerance = _TOLERANCE if solver.tolerance is None else solver.tolerance
    is_warm = jnp.all(jnp.isfinite(start))
    reached = follow(equilibrium, start, solver.steps, tolerance, is_warm)
    rotations = jax.vmap(rotation_of)(reached.nodes.quaternions)
    end, rotation = actuator.bending_length * reached.nodes.positions[-1], rotations[-1]
    tangents, position = rotations[:, :, 2], cap_centre(actuator, equilibrium.offset, end, rotation)
    if mount is not None:
        end, position, rotation = (product(mount, part) for part in (end, position, rotation))
        tangents = product(mount, tangents.T).T
    angle, plane = bending(tangents, end)
    converged = (reached.load_fraction == 1.0) & (reached.outcome == CONVERGED)
    return Tip(position, rotation, angle, plane, reached.unknown, converged, reached.stable)


def _weighted(columns: Any, weights: Any) -> Any:
    """Sum of three columns, in the last axis, with weights; see `product`."""
    return columns[..., 0] * weights[0] + columns[..., 1] * weights[1] + columns[..., 2] * weights[2]


def _mounted(
    actuator: Actuator, law: CurvatureLaw, pressure: Any, loads: Resultants
) -> tuple[Equilibrium, Any]:
    """Equations in the frame of the first section, and that frame where it is not the base's."""
    turn, offset = base_turn(actuator, pressure, law.free_curvature), tip_offset(actuator, law.free_curvature)
    if turn is None:
        return Equilibrium(law, loads, actuator, offset), None
    one, none = jnp.ones_like(turn[0]), jnp.zeros_like(turn[0])
    frame: Quaternion = turn_by((one, none, none, none), triple(turn))
    return Equilibrium(law, mounted(loads, frame), actuator, offset), rotation_of(jnp.stack(frame))


def change_of(
    law: CurvatureLaw,
    law_by_pressure: Any,
    actuator: Actuator,
    loads: Resultants,
    pressure: Any,
    unknown: Any,
    steps: int,
) -> TipChange:
    """Derivatives by the implicit function theorem, within a kernel.

    With x the unknowns, θ the inputs, y the tip and e(x, θ) = 0: dy/dθ = y_θ − y_x e_x⁻¹ e_θ.
    """

    def tip(change: Any) -> Any:
        by_pressure, force = change[3:6], change[6:]
        moved_law = jax.tree.map(lambda at, slope: at + _weighted(slope, by_pressure), law, law_by_pressure)
        pushed = loads._replace(
            end_force=loads.end_force + force,
            cap_force=loads.cap_force + force,
            lever=loads.lever + actuator.tip_length * force,
        )
        moved, mount = _mounted(actuator, moved_law, pressure + by_pressure, pushed)
        nodes, imbalance = march(moved, unknown + change[:3], steps)
        rotation = rotation_of(nodes.quaternions[-1])
        position = cap_centre(actuator, moved.offset, actuator.bending_length * nodes.positions[-1], rotation)
        if mount is not None:
            position, rotation = product(mount, position), product(mount, rotation)
        return (position, rotation, imbalance), rotation

    (position, rotation, imbalance), at = jax.jacfwd(tip, has_aux=True)(jnp.zeros(9, unknown.dtype))
    skew = jnp.sum(rotation[:, None] * at[None, :, :, None], axis=2)
    turn = jnp.stack([skew[2, 1], skew[0, 2], skew[1, 0]])
    columns = triple(imbalance[:, 0]), triple(imbalance[:, 1]), triple(imbalance[:, 2])
    shifts = [jnp.stack(solve(columns, triple(imbalance[:, 3 + k]))) for k in range(6)]
    by_input = jnp.stack(shifts, axis=1)

    def total(y: Any) -> Any:
        return y[:, 3:] - jnp.sum(y[:, :3, None] * by_input[None], axis=1)

    return TipChange(total(position), total(turn))
