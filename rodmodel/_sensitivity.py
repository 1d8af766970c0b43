"""How an equilibrium changes with its parameters: the linearised equations, integrated along the rod.

With φ the turn of a section in the body frame, δR = R φ̂, and κ = u L,

    φ' = δκ − κ × φ,   δκ' = H_f (f × φ) + H_κ δκ + b

where κ' = h(f, κ) are the equations of the rod, f = Rᵀn, H its derivatives, and b what the parameters change
in h at a given section. Written in arrays and for all nodes at once: derivatives of any order and in both
modes compile quickly, as those of the solvers' scalars do not.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._balance import Equilibrium
from rodmodel._march import Nodes
from rodmodel._nodes import integral_matrix, middle_matrix
from rodmodel._rotation import cross_matrix, rotation_of


class _Linearised(NamedTuple):
    """At the starts, middles and ends of the steps."""

    start: Array
    middle: Array
    end: Array


def nodes_tangent(
    equilibrium: Equilibrium, equilibrium_dot: Equilibrium, nodes: Nodes, unknown: Float[Array, " n"]
) -> tuple[Nodes, Float[Array, " n"]]:
    """Change of an equilibrium with its parameters, by the implicit function theorem.

    Parameters
    ----------
    equilibrium, equilibrium_dot : equations and loads, and their change.
    nodes : of the equilibrium, fine enough to integrate over.
    unknown : of the shooting.

    Returns
    -------
    nodes : their change.
    unknown : its change.
    """
    steps = nodes.turns.shape[0] - 1
    dtype = unknown.dtype
    fractions = jnp.linspace(0.0, 1.0, steps + 1, dtype=dtype)
    rotations = jax.vmap(rotation_of)(nodes.quaternions)
    follower = unknown[3:] if equilibrium.unknowns == 6 else None

    def body_force(
        e: Equilibrium, s: Float[Array, ""], R: Float[Array, "3 3"], push: Float[Array, "3"] | None
    ) -> Float[Array, "3"]:
        return R.T @ e.section_force(s, push)

    forces = jax.vmap(body_force, (None, 0, 0, None))(equilibrium, fractions, rotations, follower)
    by_force, by_turn = jax.vmap(jax.jacfwd(equilibrium.turn_rates, (1, 2)))(fractions, forces, nodes.turns)
    crosses = jax.vmap(cross_matrix)
    identity = jnp.broadcast_to(jnp.eye(3, dtype=dtype), by_turn.shape)
    matrices = _placed(
        jnp.block([[-crosses(nodes.turns), identity], [by_force @ crosses(forces), by_turn]]), steps
    )

    def rates(e: Equilibrium) -> Float[Array, "n 3"]:
        f = jax.vmap(body_force, (None, 0, 0, None))(e, fractions, rotations, follower)
        return jax.vmap(e.turn_rates)(fractions, f, nodes.turns)

    forcing = jax.jvp(rates, (equilibrium,), (equilibrium_dot,))[1]
    base = jnp.zeros((6, equilibrium.unknowns), dtype).at[3:, :3].set(jnp.eye(3, dtype=dtype))
    pushes = jnp.zeros((steps + 1, 3, equilibrium.unknowns), dtype)
    if follower is not None:
        pushes = pushes.at[:, :, 3:].set(by_force @ jnp.swapaxes(rotations, 1, 2))
    by_unknown = _integrate(matrices, pushes, base, steps)
    by_parameter = _integrate(matrices, forcing[:, :, None], jnp.zeros((6, 1), dtype), steps)[:, :, 0]

    def imbalance(
        e: Equilibrium, change: Float[Array, "6"], push: Float[Array, "3"] | None
    ) -> Float[Array, " n"]:
        end = rotations[-1] @ (jnp.eye(3, dtype=dtype) + cross_matrix(change[:3]))
        return e.end_balance(end, nodes.turns[-1] + change[3:], push)

    none = jnp.zeros(6, dtype)
    by_end = jax.jacfwd(imbalance, 1)(equilibrium, none, follower)
    jacobian = by_end @ by_unknown[-1]
    if follower is not None:
        jacobian = jacobian.at[:, 3:].add(jax.jacfwd(imbalance, 2)(equilibrium, none, follower))
    by_loads = jax.jvp(lambda e: imbalance(e, none, follower), (equilibrium,), (equilibrium_dot,))[1]
    unknown_dot = -jnp.linalg.solve(jacobian, by_end @ by_parameter[-1] + by_loads)

    change = by_parameter + by_unknown @ unknown_dot
    turns = change[:, :3]

    def direction(
        e: Equilibrium,
        push: Float[Array, "3"] | None,
        turn: Float[Array, "3"],
        s: Float[Array, ""],
        R: Float[Array, "3 3"],
    ) -> Float[Array, "3"]:
        ahead = R @ (jnp.eye(3, dtype=dtype) + cross_matrix(turn))[:, 2]
        if e.shear is None:
            return ahead
        force = e.section_force(s, push)
        return ahead + e.shear * (force - jnp.dot(ahead, force) * ahead)

    def moved(s: Float[Array, ""], R: Float[Array, "3 3"], turn: Float[Array, "3"]) -> Float[Array, "3"]:
        push_dot = None if follower is None else unknown_dot[3:]
        at = equilibrium, follower, jnp.zeros_like(turn)
        tangents = equilibrium_dot, push_dot, turn
        changed: Float[Array, 3] = jax.jvp(lambda e, push, t: direction(e, push, t, s, R), at, tangents)[1]
        return changed

    along = jax.vmap(moved)(fractions, rotations, turns)
    positions = jnp.asarray(integral_matrix(steps), dtype) @ along
    w, v = nodes.quaternions[:, :1], nodes.quaternions[:, 1:]
    quaternions = 0.5 * jnp.concatenate(
        [-jnp.sum(v * turns, axis=1, keepdims=True), w * turns + jnp.cross(v, turns)], axis=1
    )
    return Nodes(positions, quaternions, change[:, 3:]), unknown_dot


def _placed(at_nodes: Array, steps: int) -> _Linearised:
    """Values at starts, middles and ends of the steps, of values at the nodes."""
    middles = jnp.tensordot(jnp.asarray(middle_matrix(steps), at_nodes.dtype), at_nodes, axes=1)
    return _Linearised(at_nodes[:-1], middles, at_nodes[1:])


def _integrate(
    matrices: _Linearised, forcing: Float[Array, "n 3 m"], base: Float[Array, "6 m"], steps: int
) -> Float[Array, "n 6 m"]:
    """Solve X' = A X + (0, b) from X(0) by the classical Runge-Kutta method; X at the nodes."""
    h = 1.0 / steps
    a, b, c = matrices
    p, q, r = _placed(jnp.concatenate([jnp.zeros_like(forcing), forcing], axis=1), steps)

    def along(x: Float[Array, "6 m"], at: tuple[Array, ...]) -> tuple[Array, Array]:
        a, b, c, p, q, r = at
        k1 = a @ x + p
        k2 = b @ (x + 0.5 * h * k1) + q
        k3 = b @ (x + 0.5 * h * k2) + q
        k4 = c @ (x + h * k3) + r
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return x, x

    _, found = jax.lax.scan(along, base, (a, b, c, p, q, r))
    return jnp.concatenate([base[None], found])
