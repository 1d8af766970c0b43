"""The tip under pressures and loads, with its derivatives, within a kernel: what a control loop asks for."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from rodmodel._balance import Equilibrium
from rodmodel._bending import bending
from rodmodel._components import Quaternion, screw_by, solve, triple, turn_by
from rodmodel._ends import base_turn, cap_centre, product, tip_offset
from rodmodel._equilibria import FixedStep
from rodmodel._follow import CONVERGED, follow
from rodmodel._jacobian import turn_change
from rodmodel._loads import Resultants, mounted
from rodmodel._march import march
from rodmodel._rotation import rotation_of
from rodmodel._shape import ARC_SAMPLES
from rodmodel.calibration_file import Actuator
from rodmodel.section import CurvatureLaw, LawNearby, SectionLaw

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
    """Derivatives of a tip by the three pressures and, under loads, the tip force, as columns."""

    position: Float[Array, "3 n"]
    """[m/Pa] and [m/N]"""
    turn: Float[Array, "3 n"]
    """Of the small turn of the cap, δR = (turn × R) [rad/Pa] and [rad/N]."""


def solve_and_differentiate_tip(
    section: SectionLaw,
    actuator: Actuator,
    loads: Resultants,
    solver: FixedStep,
    pressure: Float[Array, "3"],
    start: Float[Array, "3"],
    by_force: bool = True,
) -> tuple[Tip, TipChange]:
    """Solve a rod with fixed steps, and differentiate them, within a kernel.

    Parameters
    ----------
    section, actuator : of the rod.
    loads : in the frame of the base.
    solver : its tolerance is 1e-7 where it has none.
    pressure : of the chambers [Pa].
    start : `unknown` of a tip nearby; NaN for none.
    by_force : whether to differentiate by the tip force too.
    """
    law, change = jax.linearize(section.at, pressure)
    tip = tip_of(law, actuator, loads, solver, pressure, start)
    return tip, _change_of(law, change, actuator, loads, pressure, tip.unknown, solver.steps, by_force)


def free_tip(section: SectionLaw, actuator: Actuator, pressure: Float[Array, "3"]) -> tuple[Tip, TipChange]:
    """Tip of a rod without loads, an arc, and its derivatives by the pressures, within a kernel."""
    free, slope_along = jax.linearize(section.free_curvature, pressure)
    length = actuator.bending_length

    def pose(pressure: Any, curvature: Any) -> Any:
        turn = triple(length * curvature)
        one, none = jnp.ones_like(turn[0]), jnp.zeros_like(turn[0])
        straight: Quaternion = (one, none, none, none)
        quaternion, end = screw_by(straight, turn, (none, none, length * one))
        rotation = rotation_of(jnp.stack(quaternion))
        offset = tip_offset(actuator, curvature)
        position = cap_centre(actuator, offset, jnp.stack(end), rotation)
        base = base_turn(actuator, pressure, section.at(pressure), curvature)
        if base is None:
            return (position, rotation), (jnp.stack(end), None)
        mount = rotation_of(jnp.stack(turn_by(straight, triple(base))))
        return (product(mount, position), product(mount, rotation)), (product(mount, jnp.stack(end)), mount)

    (position, rotation), along, (end, mount) = jax.linearize(pose, pressure, free, has_aux=True)
    columns = [along(unit, slope_along(unit)) for unit in jnp.eye(3, dtype=pressure.dtype)]
    shifts, turns = (jnp.stack([column[part] for column in columns], axis=-1) for part in range(2))
    tangents = _arc_tangents(length * free)
    angle, plane = bending(tangents if mount is None else product(mount, tangents.T).T, end)
    good = jnp.all(jnp.isfinite(position))
    tip = Tip(position, rotation, angle, plane, length * free, good, good)
    return tip, TipChange(shifts, turn_change(rotation, turns))


def _arc_tangents(turn: Float[Array, "3"]) -> Float[Array, "n 3"]:
    """Tangents along an arc of a whole turn Ω, close enough to count half turns."""
    part = jnp.asarray(np.linspace(0.0, 1.0, ARC_SAMPLES), turn.dtype)
    one, none = jnp.ones_like(part), jnp.zeros_like(part)
    parts = (part * turn[0], part * turn[1], part * turn[2])
    quaternions = jnp.stack(turn_by((one, none, none, none), parts), axis=1)
    return jax.vmap(rotation_of)(quaternions)[:, :, 2]


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


def _mounted(
    actuator: Actuator, law: CurvatureLaw, pressure: Any, loads: Resultants
) -> tuple[Equilibrium, Any]:
    """Equations in the frame of the first section, and that frame where it is not the base's."""
    free = law.free_curvature
    turn, offset = base_turn(actuator, pressure, law, free), tip_offset(actuator, free)
    if turn is None:
        return Equilibrium(law, loads, actuator, offset), None
    one, none = jnp.ones_like(turn[0]), jnp.zeros_like(turn[0])
    frame: Quaternion = turn_by((one, none, none, none), triple(turn))
    return Equilibrium(law, mounted(loads, frame), actuator, offset), rotation_of(jnp.stack(frame))


def _change_of(
    law: CurvatureLaw,
    law_change: Callable[[Any], CurvatureLaw],
    actuator: Actuator,
    loads: Resultants,
    pressure: Any,
    unknown: Any,
    steps: int,
    by_force: bool,
) -> TipChange:
    """Derivatives by the implicit function theorem; `law_change` is that of the law along pressures.

    With x the unknowns, θ the inputs, y the tip and e(x, θ) = 0: dy/dθ = y_θ − y_x e_x⁻¹ e_θ.
    """
    slopes = jax.vmap(law_change)(jnp.eye(3, dtype=unknown.dtype))

    def tip(change: Any) -> Any:
        by_pressure, force = change[3:6], change[6:]
        moved_law = LawNearby(law, slopes, by_pressure)
        pushed = loads
        if by_force:
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

    (position, rotation, imbalance), at = jax.jacfwd(tip, has_aux=True)(
        jnp.zeros(9 if by_force else 6, unknown.dtype)
    )
    turn = turn_change(at, rotation)
    columns = triple(imbalance[:, 0]), triple(imbalance[:, 1]), triple(imbalance[:, 2])
    shifts = [jnp.stack(solve(columns, triple(imbalance[:, k]))) for k in range(3, imbalance.shape[1])]
    by_input = jnp.stack(shifts, axis=1)

    def total(y: Any) -> Any:
        return y[:, 3:] - jnp.sum(y[:, :3, None] * by_input[None], axis=1)

    return TipChange(total(position), total(turn))
