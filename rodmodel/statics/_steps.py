"""Integration along the rod by fixed steps: a Munthe-Kaas method of order 4, exact for constant curvature."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from rodmodel.kinematics import rotation_of, screw
from rodmodel.statics._equilibrium import Equilibrium, State

# Largest difference of orders 2 and 4 within a step, over 1 + the largest u L: above, steps are too few.
_ROUGHNESS = 0.02
# Largest distance of a section from the base, over its arc length.
_STRETCH = 1.02

# One row per stage: fraction of the step, factor of the bracket of k₁ with the stage before, weight.
_STAGES = np.array(
    [[0.0, 0.0, 1.0 / 6.0], [0.5, 0.0, 1.0 / 3.0], [0.5, 0.125, 1.0 / 3.0], [1.0, 0.0, 1.0 / 6.0]]
)


def step(
    equilibrium: Equilibrium,
    fraction: Float[Array, ""],
    h: float,
    state: State,
    unknown: Float[Array, " n"],
) -> tuple[State, Float[Array, ""]]:
    """Take one step along the rod.

    With k₁ … k₄ the values of u L at the stages of the classical Runge-Kutta method of order 4 and h the
    step's part of the length, the frames at the stages are R, R exp(h k₁/2), R exp(h k₂/2 + h² [k₁, k₂]/8)
    and R exp(h k₃), and that at the end R exp(Ω) with

        Ω = h (k₁ + 2 k₂ + 2 k₃ + k₄)/6 + h² [k₁, k₄]/12

    in se(3), with brackets of the pair (e₃, u L). If all k are equal, the step is the screw motion of that
    curvature. The shear part of the position is summed over the stages with the same weights.

    Parameters
    ----------
    equilibrium : equations of the rod.
    fraction : s/L where the step starts.
    h : length of the step over that of the body.
    state : section at the start.
    unknown : unknowns of the equilibrium.

    Returns
    -------
    state : section at the end.
    roughness : difference of u L at the end between orders 2 and 4 [rad].

    References
    ----------
    Munthe-Kaas and Owren (1999), Phil. Trans. R. Soc. A 357, 957, sec. 4. Brackets have the opposite sign
    here, as the frame is multiplied from the right.
    """
    r, R, k1 = state
    zero = jnp.zeros_like(k1)

    def stage(at: _Stages, row: Float[Array, "3"]) -> tuple["_Stages", None]:
        part, bracket, weight = row
        k = k1 + part * h * at.rate
        Q = R @ rotation_of(part * h * at.k + bracket * h**2 * jnp.cross(k1, at.k))
        f = Q.T @ equilibrium.force(fraction + part * h, unknown)
        rate = equilibrium.turn_rate(f, k)
        drift = Q @ (equilibrium.direction(f) - axis)
        sums = (at.ks + weight * k, at.rates + weight * rate, at.drifts + weight * drift)
        return _Stages(k, rate, *sums), None

    axis = jnp.array([0.0, 0.0, 1.0], k1.dtype)
    end, _ = jax.lax.scan(stage, _Stages(k1, *4 * [zero]), jnp.asarray(_STAGES, k1.dtype))
    turn = h * end.ks + h**2 / 12.0 * jnp.cross(k1, end.k)
    shift, rotation = screw(turn, h * axis + h**2 / 12.0 * jnp.cross(k1 - end.k, axis))
    k = k1 + h * end.rates
    return State(r + R @ shift + h * end.drifts, R @ rotation, k), jnp.max(jnp.abs(k - end.k))


class _Stages(NamedTuple):
    """The last stage's u L and its rate, and weighted sums of both and of the shear part of r'."""

    k: Float[Array, "3"]
    rate: Float[Array, "3"]
    ks: Float[Array, "3"]
    rates: Float[Array, "3"]
    drifts: Float[Array, "3"]


def march(equilibrium: Equilibrium, unknown: Float[Array, " n"], steps: int) -> tuple[State, Bool[Array, ""]]:
    """Integrate from base to end.

    Returns
    -------
    nodes : `steps` + 1 sections.
    resolved : whether the steps are short enough for the curvature's changes.
    """
    h = 1.0 / steps

    def along(state: State, fraction: Float[Array, ""]) -> tuple[State, tuple[State, Array]]:
        after, roughness = step(equilibrium, fraction, h, state, unknown)
        return after, (after, roughness)

    base = equilibrium.base(unknown)
    _, (states, roughness) = jax.lax.scan(along, base, h * jnp.arange(steps, dtype=unknown.dtype))
    nodes = jax.tree.map(lambda first, others: jnp.concatenate([first[None], others]), base, states)
    smooth = jnp.all(roughness <= _ROUGHNESS * (1.0 + jnp.max(jnp.abs(states.turn))))
    return nodes, smooth & no_longer_than_the_rod(nodes)


def no_longer_than_the_rod(nodes: State) -> Bool[Array, ""]:
    """Return whether no section is farther from the base than its arc length."""
    parts = jnp.linspace(0.0, 1.0, nodes.position.shape[0], dtype=nodes.position.dtype)
    return jnp.all(jnp.linalg.norm(nodes.position, axis=1) <= _STRETCH * parts)
