"""Sensitivities of an equilibrium: the linearised equations, integrated along the rod.

With φ the turn of a section in the body frame, δR = R φ̂, κ = u L and ρ the change of r/L,

    φ' = δκ − κ × φ,   δκ' = H_f (f × φ + Rᵀδn) + H_κ δκ + b,   ρ' = R (φ × v + V (f × φ + Rᵀδn) + c)

where κ' = h(f, κ) and Rᵀr' = v(f) are the equations of the rod, f = Rᵀn, H and V their derivatives, δn the
change of a follower force, and b and c the changes of h and v with the parameters at a given section.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.kinematics import cross_matrix, middle_matrix
from rodmodel.statics._equilibrium import Equilibrium, State


class Neighbours(NamedTuple):
    """Neighbouring solutions: small changes of the nodes, one direction per index of the last axis."""

    rotation: Float[Array, "nodes 3 m"]
    """φ, body frame."""
    turn: Float[Array, "nodes 3 m"]
    """Change δκ of u L."""
    position: Float[Array, "nodes 3 m"]
    """ρ, base frame."""


def by_unknowns(
    equilibrium: Equilibrium, nodes: State, unknown: Float[Array, " n"]
) -> tuple[Neighbours, Float[Array, "n n"]]:
    """Return the derivatives of the nodes and of the imbalance at the end by the unknowns."""
    n = equilibrium.unknowns
    base = jnp.zeros((9, n), unknown.dtype).at[3:6, :3].set(jnp.eye(3, dtype=unknown.dtype))
    forces = jnp.zeros((3, n), unknown.dtype).at[:, 3:].set(jnp.eye(3, dtype=unknown.dtype)[:, : n - 3])
    matrices, by_force = _linearised(equilibrium, nodes, unknown)
    forcing = jax.vmap(lambda by, R: by @ R.T @ forces)(by_force, nodes.rotation)
    changes = _integrate(matrices, forcing, base)

    def residual(end: Float[Array, "9"], unknown: Float[Array, " n"]) -> Float[Array, " n"]:
        return equilibrium.imbalance(_moved(nodes, end), unknown)

    by_end, direct = jax.jacfwd(residual, (0, 1))(jnp.zeros(9, unknown.dtype), unknown)
    end = jnp.concatenate([changes.rotation[-1], changes.turn[-1], changes.position[-1]])
    # u L at the base enters through the state at the end alone; a follower force enters directly too.
    return changes, by_end @ end + direct.at[:, :3].set(0.0)


def equilibrium_change(
    equilibrium: Equilibrium, equilibrium_dot: Equilibrium, nodes: State, unknown: Float[Array, " n"]
) -> tuple[State, Float[Array, " n"]]:
    """Return the change of an equilibrium with its parameters, by the implicit function theorem.

    Parameters
    ----------
    equilibrium, equilibrium_dot : equations and loads, and their change.
    nodes, unknown : sections and unknowns of the equilibrium.

    Returns
    -------
    nodes, unknown : changes of sections and unknowns.
    """
    changes, jacobian = by_unknowns(equilibrium, nodes, unknown)
    matrices, _ = _linearised(equilibrium, nodes, unknown)
    fractions = _fractions(nodes)

    def rates(e: Equilibrium) -> Float[Array, "nodes 9"]:
        def at(s: Float[Array, ""], state: State) -> Float[Array, "9"]:
            force = state.rotation.T @ e.force(s, unknown)
            direction = state.rotation @ e.direction(force)
            return jnp.concatenate([jnp.zeros_like(force), e.turn_rate(force, state.turn), direction])

        return jax.vmap(at)(fractions, nodes)

    forcing = jax.jvp(rates, (equilibrium,), (equilibrium_dot,))[1]
    driven = _integrate(matrices, forcing[:, :, None], jnp.zeros((9, 1), unknown.dtype))
    end_dot = jnp.concatenate([driven.rotation[-1], driven.turn[-1], driven.position[-1]])[:, 0]
    imbalance_dot = jax.jvp(
        lambda e, end: e.imbalance(_moved(nodes, end), unknown),
        (equilibrium, jnp.zeros_like(end_dot)),
        (equilibrium_dot, end_dot),
    )[1]
    unknown_dot = -jnp.linalg.solve(jacobian, imbalance_dot)
    phi, turn, position = (own[:, :, 0] + by @ unknown_dot for own, by in zip(driven, changes, strict=True))
    rotation = jax.vmap(lambda R, w: R @ cross_matrix(w))(nodes.rotation, phi)
    return State(position, rotation, turn), unknown_dot


def _linearised(
    equilibrium: Equilibrium, nodes: State, unknown: Float[Array, " n"]
) -> tuple[Float[Array, "nodes 9 9"], Float[Array, "nodes 9 3"]]:
    """Return the matrices of the linearised equations at the nodes, for (φ, δκ, ρ) and for Rᵀδn."""

    def at(s: Float[Array, ""], state: State) -> tuple[Array, Array]:
        force = state.rotation.T @ equilibrium.force(s, unknown)
        by_force, by_turn = equilibrium.turn_rate_slopes(force, state.turn)
        shear = equilibrium.actuator.shear_compliance * state.rotation @ jnp.diag(jnp.array([1.0, 1.0, 0.0]))
        zero, force_cross = jnp.zeros((3, 3), force.dtype), cross_matrix(force)
        direction_by_turn = shear @ force_cross - state.rotation @ cross_matrix(equilibrium.direction(force))
        matrix = jnp.block(
            [
                [-cross_matrix(state.turn), jnp.eye(3, dtype=force.dtype), zero],
                [by_force @ force_cross, by_turn, zero],
                [direction_by_turn, zero, zero],
            ]
        )
        return matrix, jnp.concatenate([zero, by_force, shear])

    matrices, by_force = jax.vmap(at)(_fractions(nodes), nodes)
    return matrices, by_force


def _integrate(
    matrices: Float[Array, "nodes 9 9"], forcing: Float[Array, "nodes 9 m"], base: Float[Array, "9 m"]
) -> Neighbours:
    """Solve x' = A x + b from the base, by the classical Runge-Kutta method of order 4."""
    steps = matrices.shape[0] - 1
    h = 1.0 / steps
    between = jnp.asarray(middle_matrix(steps), matrices.dtype)

    def along(x: Float[Array, "9 m"], at: tuple[Array, ...]) -> tuple[Array, Array]:
        a, b, c, p, q, r = at
        k1 = a @ x + p
        k2 = b @ (x + 0.5 * h * k1) + q
        k3 = b @ (x + 0.5 * h * k2) + q
        k4 = c @ (x + h * k3) + r
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return x, x

    middles = (jnp.tensordot(between, values, axes=1) for values in (matrices, forcing))
    b, q = middles
    _, found = jax.lax.scan(along, base, (matrices[:-1], b, matrices[1:], forcing[:-1], q, forcing[1:]))
    found = jnp.concatenate([base[None], found])
    return Neighbours(found[:, :3], found[:, 3:6], found[:, 6:])


def _moved(nodes: State, change: Float[Array, "9"]) -> State:
    """Return the section at the end, moved by a small change."""
    turned = nodes.rotation[-1] @ (jnp.eye(3, dtype=change.dtype) + cross_matrix(change[:3]))
    return State(nodes.position[-1] + change[6:], turned, nodes.turn[-1] + change[3:6])


def _fractions(nodes: State) -> Float[Array, " nodes"]:
    return jnp.linspace(0.0, 1.0, nodes.turn.shape[0], dtype=nodes.turn.dtype)
