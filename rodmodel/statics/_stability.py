"""Stability of an equilibrium of the rod, from the neighbouring solutions that start at the base.

The stiffness of every section must be positive definite (Legendre's condition); elsewhere a wall of the
section would snap. Forces and weight have a potential. An equilibrium is a minimum of the energy if no two
neighbouring solutions from the base meet again along the rod, ∂θ(s)/∂u₀ regular with θ the turn of a section
(Jacobi's condition), and if the free end resists every turn, ∂m/∂θ positive definite there. A rod that may
buckle to any side violates either condition in two directions at once, and a determinant keeps its sign. So
eigenvalues are tested, for the first condition those of ∂θ(s)/∂u₀ from node to node. A dead or follower
moment and a follower force have no potential. Then the loads must have passed no bifurcation: the determinant
of the shooting Jacobian must be positive, as it is without loads.

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
    """Return whether the second variation is positive; without a potential, if no bifurcation was passed.

    Parameters
    ----------
    equilibrium : equations and loads.
    nodes : sections of the equilibrium.
    changes : derivatives of the nodes by the unknowns.
    jacobian : derivative of the imbalance by the unknowns.
    """
    stiffness = jax.vmap(equilibrium.law.stiffness)(nodes.turn / equilibrium.actuator.bending_length)
    convex = jnp.all(jax.vmap(is_positive)(stiffness))
    no_bifurcation = jnp.linalg.det(jacobian) > 0.0
    if equilibrium.unknowns == 6:
        return convex & no_bifurcation
    # In the frame of the base, turns of neighbouring nodes can be compared.
    turns = nodes.rotation @ changes.rotation
    regular = jax.vmap(lambda before, after: is_positive(_ratio(before, after)))(turns[1:-1], turns[2:])
    # With B the turns of the end and A its moments, B⁻¹ A has the eigenvalues of ∂m/∂θ = A B⁻¹.
    resists = is_positive(_ratio(changes.rotation[-1], jacobian))
    loads = equilibrium.loads
    conservative = jnp.all(loads.end_moment == 0.0) & jnp.all(loads.follower_moment == 0.0)
    return convex & jnp.where(conservative, jnp.all(regular) & resists, no_bifurcation)


def _ratio(by: Float[Array, "3 3"], matrix: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Return the matrix B⁻¹ A."""
    return jax.vmap(solve_3x3, (None, 1), 1)(by, matrix)


def is_positive(matrix: Float[Array, "3 3"]) -> Bool[Array, ""]:
    """Return whether all eigenvalues are positive, given that all are real.

    This holds if the coefficients of the characteristic polynomial have the signs that they have for the
    identity.
    """
    a, b, c = matrix
    minors = jnp.cross(b, c)[0] + jnp.cross(c, a)[1] + jnp.cross(a, b)[2]
    return (jnp.trace(matrix) > 0.0) & (minors > 0.0) & (a @ jnp.cross(b, c) > 0.0)
