"""Stability of an equilibrium of the rod, from the neighbouring solutions that start at the base.

Forces and weight have a potential. An equilibrium is a minimum of the energy if no two neighbouring solutions
from the base meet again along the rod, ∂θ(s)/∂u₀ regular with θ the turn of a section (Jacobi's condition),
and if the free end resists every turn, ∂m/∂θ positive definite there. A rod that may buckle to any side meets
both twice at once, where a determinant keeps its sign; so eigenvalues are looked at, of ∂θ(s)/∂u₀ from node
to node for the first. A dead or follower moment and a follower force have no potential; what is asked then is
that the loads passed no branching of equilibria on their way: that the determinant of the shooting Jacobian
is positive, as it is without loads.

References
----------
Gelfand and Fomin (1963), Calculus of Variations, ch. 5. Kumar and Healey (2010), J. Elast. 98, 89, for rods.
"""

from jaxtyping import Array, Bool, Float

from rodmodel._balance import Variation
from rodmodel._components import Quaternion, Triple, cross, dot, out_of_body, solve, triple

Columns = tuple[Triple, Triple, Triple]


def no_fold(
    before: list[Variation], frame_before: Quaternion, after: list[Variation], frame_after: Quaternion
) -> Bool[Array, ""]:
    """Whether neighbouring solutions stay apart from one node to the next: ∂θ/∂u₀ keeps its signs.

    Turns are compared in the frame of the base, in which they do not turn with the rod.
    """
    first = tuple(out_of_body(frame_before, turn) for turn in _turns(before))
    second = tuple(out_of_body(frame_after, turn) for turn in _turns(after))
    return _is_positive(_divide((first[0], first[1], first[2]), (second[0], second[1], second[2])))


def end_resists(variations: list[Variation], imbalance_by_turn: Float[Array, "3 3"]) -> Bool[Array, ""]:
    """Whether the end resists every turn, of the solutions at the end and the moments that they lack."""
    moments = tuple(triple(imbalance_by_turn[:, k]) for k in range(3))
    # A B⁻¹ is wanted, and B⁻¹ A has its eigenvalues.
    return _is_positive(_divide(_turns(variations), (moments[0], moments[1], moments[2])))


def _turns(variations: list[Variation]) -> Columns:
    a, b, c = (variation.rotation for variation in variations[:3])
    return a, b, c


def _divide(by: Columns, matrix: Columns) -> Columns:
    a, b, c = (solve(by, column) for column in matrix)
    return a, b, c


def _is_positive(matrix: Columns) -> Bool[Array, ""]:
    """Whether no real eigenvalue is negative or zero, given that all are real.

    So they are if all coefficients of the characteristic polynomial have the signs that they have for the
    identity.
    """
    a, b, c = matrix
    trace = a[0] + b[1] + c[2]
    minors = (a[0] * b[1] - a[1] * b[0]) + (a[0] * c[2] - a[2] * c[0]) + (b[1] * c[2] - b[2] * c[1])
    return (trace > 0.0) & (minors > 0.0) & (dot(a, cross(b, c)) > 0.0)
