"""Derivatives of the pose by pressures and loads, along the rod if asked."""

from collections.abc import Callable
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.kinematics import turn_change
from rodmodel.statics import Solution

# |bend| below which a rod is straight [rad].
_STRAIGHT = 1e-6


@final
class PoseDerivative(eqx.Module):
    """Derivative of the pose by one input; its three components are the last axis of each array.

    Attributes
    ----------
    tip_position : derivative of the centre of the cap's outer face [m].
    tip_turn : small turn of the cap in the world frame, δR = (turn × R) [rad].
    bend : derivative of (θ cos γ, θ sin γ) [rad].
    bending_angle, bending_plane : derivatives of θ and γ [rad]; NaN for a straight rod, |bend| < 1e-6 rad,
        where neither is differentiable.
    positions, turns : derivatives of the sections at `arc_lengths`, as for the tip.
    """

    tip_position: Float[Array, "3 3"]
    tip_turn: Float[Array, "3 3"]
    bend: Float[Array, "2 3"]
    bending_angle: Float[Array, "3"]
    bending_plane: Float[Array, "3"]
    positions: Float[Array, "s 3 3"]
    turns: Float[Array, "s 3 3"]


@final
class Jacobian(eqx.Module):
    """Derivatives of the pose of a rod by each input.

    Attributes
    ----------
    pressure : derivatives by the pressures [1/Pa].
    tip_force : derivatives by the tip force [1/N]: the compliance of the rod at its tip.
    tip_moment : derivatives by the tip moment [1/(N m)].
    gravity : derivatives by the acceleration [s²/m].
    arc_lengths : arc lengths of the sections along the rod [m].
    """

    pressure: PoseDerivative
    tip_force: PoseDerivative
    tip_moment: PoseDerivative
    gravity: PoseDerivative
    arc_lengths: Float[Array, " s"]


def jacobian_of(
    solve: Callable[[dict[str, Array]], Solution], inputs: dict[str, Array], arc_lengths: Float[Array, " s"]
) -> tuple[Solution, Jacobian]:
    """Solve, and differentiate the pose by each input.

    Parameters
    ----------
    solve : function that returns the solution for inputs.
    inputs : pressure, tip_force, tip_moment and gravity, by name.
    arc_lengths : arc lengths of the sections whose poses to differentiate besides the tip's [m].
    """

    def pose(inputs: dict[str, Array]) -> tuple[dict[str, Array], tuple[Solution, dict[str, Array]]]:
        solution = solve(inputs)
        answer = {
            "tip_position": solution.tip_position,
            "tip_rotation": solution.tip_rotation,
            "bend": solution.bend,
            "bending_angle": solution.bending_angle,
            "bending_plane": solution.bending_plane,
            "positions": solution.centreline(arc_lengths),
            "rotations": solution.frames(arc_lengths),
        }
        return answer, (solution, answer)

    by_inputs, (solution, answer) = jax.jacfwd(pose, has_aux=True)(inputs)
    straight = jnp.linalg.norm(solution.bend) < _STRAIGHT
    turns = jax.vmap(turn_change, (None, 2), 1)

    def by(name: str) -> PoseDerivative:
        slope = {quantity: values[name] for quantity, values in by_inputs.items()}
        return PoseDerivative(
            tip_position=slope["tip_position"],
            tip_turn=turns(answer["tip_rotation"], slope["tip_rotation"]),
            bend=slope["bend"],
            bending_angle=jnp.where(straight, jnp.nan, slope["bending_angle"]),
            bending_plane=jnp.where(straight, jnp.nan, slope["bending_plane"]),
            positions=slope["positions"],
            turns=jax.vmap(turns)(answer["rotations"], slope["rotations"]),
        )

    jacobian = Jacobian(
        pressure=by("pressure"),
        tip_force=by("tip_force"),
        tip_moment=by("tip_moment"),
        gravity=by("gravity"),
        arc_lengths=arc_lengths,
    )
    return solution, jacobian
