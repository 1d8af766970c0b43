"""Exact volume under surface patches, with gradient and Hessian.

The signed volume between the origin and a surface, ⅓ ∫ x·(∂x/∂ξ × ∂x/∂η), is a trilinear form in the nodes
if shape functions N_a interpolate the surface:

    V = ⅙ Σ_abc W_abc x_a·(x_b × x_c),    W antisymmetric in all three indices.

Lengths mm.
"""

import itertools
from functools import cache

import numpy as np
from jaxtyping import Float, Int

from fem_reference.rotations import LEVI_CIVITA


class VolumePatch:
    """Surface facets, or fan triangles, of one kind.

    Parameters
    ----------
    connectivity : nodes of each block (facet or triangle).
    form : coefficients W of the trilinear form.
    """

    def __init__(
        self, connectivity: Int[np.ndarray, "blocks nodes"], form: Float[np.ndarray, "nodes nodes nodes"]
    ) -> None:
        self.connectivity = connectivity
        self._form = form.reshape(-1, form.shape[-1])

    def volume(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Volume under all blocks together [mm³]."""
        gradient = self.gradient(positions)
        return float((gradient * positions[self.connectivity].reshape(gradient.shape)).sum() / 3.0)

    def gradient(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "blocks dofs"]:
        """Return ∂V/∂x at each block's nodes: their shares of the vector area."""
        corner = positions[self.connectivity]
        return 0.5 * np.cross(corner[:, None], self._sums(corner)).sum(axis=2).reshape(len(corner), -1)

    def hessian(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "blocks dofs dofs"]:
        """Return ∂²V/∂x² over each block's nodes."""
        sums = self._sums(positions[self.connectivity])
        dofs = 3 * sums.shape[1]
        # ∂²(a·(b × s))/∂a_i∂b_j = ε_ijk s_k.
        blocks = (sums @ LEVI_CIVITA.reshape(9, 3).T).reshape(*sums.shape[:3], 3, 3)
        return blocks.transpose(0, 1, 3, 2, 4).reshape(-1, dofs, dofs)

    def _sums(self, corner: Float[np.ndarray, "blocks nodes 3"]) -> Float[np.ndarray, "blocks nodes nodes 3"]:
        """Return Σ_c W_abc x_c."""
        nodes = corner.shape[1]
        return (self._form @ corner).reshape(-1, nodes, nodes, 3)


@cache
def facet_form(order: int) -> Float[np.ndarray, "nodes nodes nodes"]:
    """Return W of a facet with (order + 1)² nodes in tensor order and normal ∂x/∂ξ × ∂x/∂η."""
    # The integrand's degree is 3 order − 1 in each direction.
    point, weight = np.polynomial.legendre.leggauss(2 * order)
    value, slope = _lagrange(order, 0.5 * (1.0 + point))
    functions = np.einsum("pi,qj->pqji", value, value).reshape(-1, (order + 1) ** 2)
    along = np.einsum("pi,qj->pqji", slope, value).reshape(functions.shape)
    across = np.einsum("pi,qj->pqji", value, slope).reshape(functions.shape)
    rule = np.outer(weight, weight).ravel() / 4.0
    return _antisymmetric(np.einsum("q,qa,qb,qc->abc", rule / 3.0, functions, along, across))


@cache
def fan_form(order: int) -> Float[np.ndarray, "nodes nodes nodes"]:
    """Return W of a ruled triangle: the apex, then the nodes of the opposite edge from end to end."""
    point, weight = np.polynomial.legendre.leggauss(2 * order)
    value, slope = _lagrange(order, 0.5 * (1.0 + point))
    form = np.zeros((order + 2,) * 3)
    # ⅓ ∫ det(a, e, e') t dt ds, where ∫ t dt = ½.
    form[0, 1:, 1:] = np.einsum("q,qb,qc->bc", weight / 12.0, value, slope)
    return _antisymmetric(form)


def _lagrange(order: int, x: Float[np.ndarray, " n"]) -> tuple[np.ndarray, np.ndarray]:
    """Return values and slopes of the Lagrange basis with nodes i/order on [0, 1], as (point, node)."""
    nodes = np.linspace(0.0, 1.0, order + 1)
    basis = [np.poly1d(np.delete(nodes, i), r=True) for i in range(order + 1)]
    basis = [p / p(node) for p, node in zip(basis, nodes, strict=True)]
    return np.column_stack([p(x) for p in basis]), np.column_stack([p.deriv()(x) for p in basis])


def _antisymmetric(form: Float[np.ndarray, "n n n"]) -> Float[np.ndarray, "n n n"]:
    """Return W from the coefficients of x_a·(x_b × x_c)."""
    total = np.zeros_like(form)
    for permutation in itertools.permutations(range(3)):
        sign = np.linalg.det(np.eye(3)[list(permutation)])
        total += sign * np.transpose(form, permutation)
    return total
