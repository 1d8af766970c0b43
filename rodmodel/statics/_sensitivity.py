"""Neighbouring solutions of an equilibrium: how its sections change with the unknowns and the parameters.

Each fixed step is differentiated at the section where it begins. Of nodes that such steps made, this is the
exact derivative of the integration; of more exact ones, it errs by the order of the steps.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.statics._equilibrium import Equilibrium, State
from rodmodel.statics._steps import step


def change_along(
    equilibrium: Equilibrium,
    nodes: State,
    unknown: Float[Array, " n"],
    unknown_dot: Float[Array, " n"],
    equilibrium_dot: Equilibrium | None = None,
) -> State:
    """Change of the nodes with the unknowns and, where it is given, with the equations.

    Parameters
    ----------
    equilibrium : equations.
    nodes : sections from base to end.
    unknown : of the equilibrium.
    unknown_dot, equilibrium_dot : their changes.

    Returns
    -------
    change : of the nodes.
    """
    steps = nodes.turn.shape[0] - 1
    h = 1.0 / steps

    def along(change: State, at: tuple[Float[Array, ""], State]) -> tuple[State, State]:
        fraction, state = at
        if equilibrium_dot is None:
            after = jax.jvp(
                lambda s, x: step(equilibrium, fraction, h, s, x)[0], (state, unknown), (change, unknown_dot)
            )[1]
        else:
            after = jax.jvp(
                lambda e, s, x: step(e, fraction, h, s, x)[0],
                (equilibrium, state, unknown),
                (equilibrium_dot, change, unknown_dot),
            )[1]
        return after, after

    none = jax.tree.map(jnp.zeros_like, equilibrium.base(unknown))
    base = none._replace(turn=unknown_dot[:3])
    fractions = h * jnp.arange(steps, dtype=unknown.dtype)
    starts = jax.tree.map(lambda values: values[:-1], nodes)
    _, changes = jax.lax.scan(along, base, (fractions, starts))
    return jax.tree.map(lambda first, others: jnp.concatenate([first[None], others]), base, changes)


def by_unknowns(
    equilibrium: Equilibrium, nodes: State, unknown: Float[Array, " n"]
) -> tuple[State, Float[Array, "n n"]]:
    """Derivatives of the nodes by the unknowns, and of the imbalance at the end.

    Returns
    -------
    changes : of the nodes; the leading axis is that of the unknowns.
    jacobian : of the imbalance, its columns by the unknowns.
    """

    def column(unknown_dot: Float[Array, " n"]) -> tuple[State, Float[Array, " n"]]:
        change = change_along(equilibrium, nodes, unknown, unknown_dot)
        end, end_dot = (jax.tree.map(lambda values: values[-1], states) for states in (nodes, change))
        return change, jax.jvp(equilibrium.imbalance, (end, unknown), (end_dot, unknown_dot))[1]

    changes, rows = jax.vmap(column)(jnp.eye(equilibrium.unknowns, dtype=unknown.dtype))
    return changes, rows.T


def equilibrium_change(
    equilibrium: Equilibrium, equilibrium_dot: Equilibrium, nodes: State, unknown: Float[Array, " n"]
) -> tuple[State, Float[Array, " n"]]:
    """Change of an equilibrium with its parameters, by the implicit function theorem.

    Parameters
    ----------
    equilibrium, equilibrium_dot : equations and loads, and their change.
    nodes, unknown : of the equilibrium.

    Returns
    -------
    nodes, unknown : their changes.
    """
    changes, jacobian = by_unknowns(equilibrium, nodes, unknown)
    still = jnp.zeros_like(unknown)
    driven = change_along(equilibrium, nodes, unknown, still, equilibrium_dot)
    end, end_dot = (jax.tree.map(lambda values: values[-1], states) for states in (nodes, driven))
    missing = jax.jvp(
        lambda e, end: e.imbalance(end, unknown), (equilibrium, end), (equilibrium_dot, end_dot)
    )[1]
    unknown_dot = -jnp.linalg.solve(jacobian, missing)
    total = jax.tree.map(lambda own, by: own + jnp.tensordot(unknown_dot, by, axes=1), driven, changes)
    return total, unknown_dot
