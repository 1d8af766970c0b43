"""Equilibrium of a rod as one compiled function: pose, chamber volumes, and the flags of its errors."""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel.actuator import Domain
from rodmodel.kinematics import Shape, bend, bending, cross_matrix, rotation_of
from rodmodel.rod._inputs import all_finite, is_rotation
from rodmodel.section import CurvatureLaw
from rodmodel.statics import (
    RESULTS,
    Loads,
    Solution,
    Solver,
    base_turn,
    cap_centre,
    into_base,
    result_of,
    shears_little,
    solve_shape,
    tip_offset,
    turns_little,
)

if TYPE_CHECKING:
    from rodmodel.rod._rod import Rod


@eqx.filter_jit
def solve_rod(
    rod: "Rod",
    pressure: Float[Array, "3"],
    loads: Loads,
    base_position: Float[Array, "3"] | None,
    base_rotation: Float[Array, "3 3"] | None,
    start: Float[Array, " n"] | None,
    solver: Solver,
) -> tuple[Solution, Bool[Array, "5"]]:
    """Solve; return the solution, and for each of `messages` whether it applies.

    Parameters
    ----------
    rod : with its numbers in arrays.
    pressure : gauge pressures [Pa].
    loads : in the world frame.
    base_position, base_rotation : clamp; None at the origin, and for the world frame.
    start : unknowns of another solution, from which Newton's method starts.
    solver : of the equations along the rod.
    """
    good_pressure = jnp.all(jnp.isfinite(pressure) & (pressure >= 0.0))
    good_loads = all_finite(loads)
    good_base = all_finite(base_position) & is_rotation(base_rotation)
    good = good_pressure & good_loads & good_base
    # A row with bad input is solved for zeros: its NaN would keep the rest of a batch iterating.
    pressure, loads = jax.tree.map(lambda x: jnp.where(good, x, 0.0), (pressure, loads))
    if base_rotation is not None:
        base_rotation = jnp.where(good, base_rotation, jnp.eye(3, dtype=base_rotation.dtype))
        loads = into_base(loads, base_rotation)

    def ends(pressure: Float[Array, "3"]) -> tuple[tuple[Array, Array], tuple[CurvatureLaw, Array]]:
        law = rod.section.at(pressure)
        turn = base_turn(rod.actuator, pressure, law)
        return (rotation_of(turn), tip_offset(rod.actuator, law.free_curvature)), (law, turn)

    (mount, offset), by_ends, (law, turn) = jax.vjp(ends, pressure, has_aux=True)
    shape, reached, push = solve_shape(law, into_base(loads, mount), rod.actuator, offset, start, solver)
    volume = _chamber_volume(rod, pressure, law, shape)
    base_moment = jnp.zeros_like(pressure[0])
    if push is not None:
        # Pressures turn the base and move the cap, where the loads do work; with it ∂V/∂F is the tip's
        # ∂x/∂p. m·ω is <R m̂, δR>/2 for δR = R ω̂.
        moment = law.moment(shape.samples()[0][0])
        base_moment = _norm(moment)
        (work,) = by_ends((0.5 * mount @ cross_matrix(moment), push))
        volume = volume + work

    pressure_in_domain = rod.domain.covers_pressure(pressure)
    curvatures, _ = shape.samples()
    covered = jax.vmap(rod.domain.covers_moment)(jax.vmap(law.moment)(curvatures))
    small = shears_little(loads, rod.actuator, pressure.dtype) & turns_little(turn)
    in_domain = good & pressure_in_domain & jnp.all(covered) & small
    positions, rotations = shape.poses()
    tip_rotation, tangents = mount @ rotations[-1], rotations[:, :, 2] @ mount.T
    tip_position = mount @ cap_centre(rod.actuator, offset, positions[-1], rotations[-1])
    angle, plane = bending(tangents, mount @ positions[-1])
    bent = bend(tangents[-1], angle)
    if base_rotation is not None:
        tip_position, tip_rotation = base_rotation @ tip_position, base_rotation @ tip_rotation
    if base_position is not None:
        tip_position = base_position + tip_position
    angle_bound, tip_bound = rod.error_bound.at(jnp.sum(pressure), base_moment, bending_angle=angle)
    ended: Any = result_of(reached)
    names: Any = RESULTS
    ended = RESULTS.where(jnp.all(jnp.isfinite(tip_position)), ended, names.not_converged)
    result = RESULTS.where(good, ended, names.bad_input)
    solution = Solution(
        tip_position=tip_position,
        tip_rotation=tip_rotation,
        bending_angle=angle,
        bending_plane=plane,
        bend=bent,
        chamber_volume=volume,
        converged=result == names.successful,
        result=result,
        stable=reached.stable & good,
        in_domain=in_domain,
        error_estimate=jnp.where(in_domain, angle_bound, jnp.nan),
        tip_error_estimate=jnp.where(in_domain, tip_bound, jnp.nan),
        stats={
            "load_fraction": reached.load_fraction,
            "load_steps": reached.load_steps,
            "shots": reached.shots,
        },
        shape=shape,
        unknown=reached.unknown,
        base_position=base_position,
        base_rotation=base_rotation,
        mount=mount,
        tip_offset=offset,
        tip_length=rod.actuator.tip_length,
    )
    solution = jax.tree.map(lambda x: jnp.where(good, x, jnp.nan) if eqx.is_inexact_array(x) else x, solution)
    expected = [good_pressure, good_loads, good_base, pressure_in_domain, solution.converged]
    return solution, jnp.logical_not(jnp.array(expected))


def messages(domain: Domain) -> list[str]:
    """Return the message of each of the flags of `solve_rod`."""
    flagged = "throw=False flags this in the solution instead"
    return [
        f"pressure: got a negative value or one that is not finite, expected 0 or more Pa; {flagged}",
        "tip_force, tip_moment or gravity: got a value that is not finite, here or in another load, "
        f"expected finite numbers; {flagged}",
        "base_position or base_rotation: got a value that is not finite or no rotation matrix, "
        f"expected a pose; {flagged}",
        "pressure: got more than the calibration covers, "
        f"expected at most {domain.largest_pressures('Pa')}; throw=False extrapolates",
        "solve: no equilibrium was found under the full load, expected a load that the rod can carry; "
        "throw=False returns the equilibrium at the largest fraction that was reached",
    ]


def _chamber_volume(
    rod: "Rod", pressure: Float[Array, "3"], law: CurvatureLaw, shape: Shape
) -> Float[Array, "3"]:
    """Compute the volume of the sections [m³], −∂/∂p of their potential at a fixed shape.

    The sections of the stiff tip have the free curvature, and over the held length the chambers keep
    their volume at rest. One vectorised derivative covers all.
    """
    held = rod.actuator.held_length
    free, zero = law.free_curvature, jnp.zeros_like(law.free_curvature)
    curvatures, weights = shape.samples()
    curvatures = jnp.concatenate([curvatures, free[None]])
    weights = jnp.append(weights, rod.actuator.stiff_tip - held)

    def potential(
        pressure: Float[Array, "3"], curvatures: Float[Array, "n 3"], weights: Float[Array, " n"]
    ) -> Float[Array, ""]:
        return weights @ jax.vmap(rod.section.contracted(pressure).energy)(curvatures)

    at_rest = zero, jnp.zeros_like(curvatures), jnp.zeros_like(weights).at[0].set(held)
    both = jax.tree.map(lambda *rows: jnp.stack(rows), (pressure, curvatures, weights), at_rest)
    return -jnp.sum(jax.vmap(jax.grad(potential))(*both), axis=0)


def _norm(vector: Float[Array, "3"]) -> Float[Array, ""]:
    """Return the norm of a vector, with zero derivatives where it is zero."""
    squared = vector @ vector
    safe = jnp.where(squared > 0.0, squared, 1.0)
    return jnp.where(squared > 0.0, jnp.sqrt(safe), 0.0)
