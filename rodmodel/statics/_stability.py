"""Stability of an equilibrium of the rod, from the neighbouring solutions that start at the base.

The stiffness of every section must be positive (Legendre's condition); where it is not, a wall of the section
would snap. Forces and weight have a potential. An equilibrium is a minimum of the energy if no two
neighbouring solutions from the base meet again along the rod, ∂θ(s)/∂u₀ regular with θ the turn of a section
(Jacobi's condition), and if the free end resists every turn, ∂m/∂θ positive definite there. A rod that may
buckle to any side meets both twice at once, where a determinant keeps its sign; so eigenvalues are looked at,
of ∂θ(s)/∂u₀ from node to node for the first. A dead or follower moment and a follower force have no
potential; what is asked then is that the loads passed no branching of equilibria on their way: that the
determinant of the shooting Jacobian is positive, as it is without loads.

References
----------
Gelfand and Fomin (1963), Calculus of Variations, ch. 5. Kumar and Healey (2010), J. Elast. 98, 89, for rods.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel.section import solve_3x3
from rodmodel.statics._equilibrium import Equilibrium, State
from rodmodel.statics._sensitivity import Neighbours


def is_stable(
    equilibrium: Equilibrium, nodes: State, changes: Neighbours, jacobian: Float[Array, "n n"]
) -> Bool[Array, ""]:
    """Whether the second variation is positive; without a potential, whether no branching was passed.

    Parameters
    ----------
    equilibrium : equations and loads.
    nodes : of the equilibrium.
    changes : of the nodes with each unknown.
    jacobian : of the imbalance by the unknowns.
    """
    stiffness = jax.vmap(equilibrium.law.stiffness)(nodes.turn / equilibrium.actuator.bending_length)
    convex = jnp.all(jax.vmap(is_positive)(stiffness))
    no_branching = jnp.linalg.det(jacobian) > 0.0
    if equilibrium.unknowns == 6:
        return convex & no_branching
    # Columns by the unknowns; in the frame of the base turns do not turn with the rod from node to node.
    turns = nodes.rotation @ changes.rotation
    apart = jax.vmap(lambda before, after: is_positive(_ratio(before, after)))(turns[1:-1], turns[2:])
    # With B the turns of the end and A its moments, A B⁻¹ is wanted, and B⁻¹ A has its eigenvalues.
    resists = is_positive(_ratio(changes.rotation[-1], jacobian))
    loads = equilibrium.loads
    conservative = jnp.all(loads.end_moment == 0.0) & jnp.all(loads.follower_moment == 0.0)
    return convex & jnp.where(conservative, jnp.all(apart) & resists, no_branching)


def _ratio(by: Float[Array, "3 3"], matrix: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Matrix B⁻¹ A."""
    return jax.vmap(solve_3x3, (None, 1), 1)(by, matrix)


def is_positive(matrix: Float[Array, "3 3"]) -> Bool[Array, ""]:
    """Whether no real eigenvalue is negative or zero, given that all are real.

    So they are if all coefficients of the characteristic polynomial have the signs that they have for the
    identity.
    """
    a, b, c = matrix
    minors = jnp.cross(b, c)[0] + jnp.cross(c, a)[1] + jnp.cross(a, b)[2]
    return (jnp.trace(matrix) > 0.0) & (minors > 0.0) & (a @ jnp.cross(b, c) > 0.0)
