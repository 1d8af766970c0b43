"""Stability of an equilibrium of the rod, from the neighbouring solutions that start at the base."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel._equilibrium import Equilibrium, solve_3x3, split
from rodmodel._rotation import turn_of


def is_stable(
    equilibrium: Equilibrium,
    states: Float[Array, "n 10"],
    by_turn: Float[Array, "n 10 3"],
    imbalance_by_turn: Float[Array, "3 3"],
) -> Bool[Array, ""]:
    """Whether an equilibrium to which loads led from the free shape, which is stable, is stable too.

    Forces and weight have a potential. The equilibrium is a minimum of the energy if no two neighbouring
    solutions from the base meet again along the rod, ∂θ(s)/∂u₀ regular with θ the turn of a section
    (Jacobi's condition), and if the free end resists every turn, ∂m/∂θ positive definite there. A rod that
    may buckle to any side meets both twice at once, where a determinant keeps its sign; so eigenvalues are
    looked at, of ∂θ(s)/∂u₀ from node to node for the first. A dead moment has no potential; what is asked
    then is that the loads passed no branching of equilibria on their way, det ∂m/∂u₀ > 0 at the end.

    Parameters
    ----------
    equilibrium : equations and loads.
    states : at the nodes.
    by_turn : their derivatives by u₀ L, the curvature at the base.
    imbalance_by_turn : derivative of the moment m that the end lacks, by u₀ L.

    References
    ----------
    Gelfand and Fomin (1963), Calculus of Variations, ch. 5. Kumar and Healey (2010), J. Elast. 98, 89, for
    rods.
    """
    turns = jax.vmap(turn_of)(split(states)[1], by_turn[:, 3:7])
    # A B⁻¹ is wanted, and B⁻¹ A has its eigenvalues.
    divide = jax.vmap(solve_3x3, in_axes=(None, 1), out_axes=1)
    node_to_node = jax.vmap(divide)(turns[2:], turns[1:-1])
    end_stiffness = divide(turns[-1], imbalance_by_turn)
    is_minimum = _is_positive(end_stiffness) & jnp.all(jax.vmap(_is_positive)(node_to_node))
    moment = equilibrium.loads.tip_moment
    if moment is None:
        return is_minimum
    return jnp.where(jnp.any(moment != 0.0), jnp.linalg.det(imbalance_by_turn) > 0.0, is_minimum)


def _is_positive(matrix: Float[Array, "3 3"]) -> Bool[Array, ""]:
    """Whether no real eigenvalue is negative or zero, given that all are real.

    So they are if all coefficients of the characteristic polynomial have the signs that they have for the
    identity.
    """
    trace = jnp.trace(matrix)
    minors = 0.5 * (trace**2 - jnp.sum(matrix * matrix.T))
    return (trace > 0.0) & (minors > 0.0) & (jnp.linalg.det(matrix) > 0.0)
