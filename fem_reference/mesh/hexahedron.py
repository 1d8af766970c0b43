"""Lagrange hexahedra of first and second order on the unit cube, their nodes in tensor order.

Node (i, j, k) of an element of order n has the number i + (n+1) j + (n+1)² k. The functions are scikit-fem's.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from jaxtyping import Float, Int
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex

_ELEMENTS = {1: skfem.ElementHex1, 2: skfem.ElementHex2}


@dataclass(frozen=True)
class ReferenceElement:
    """Shape functions of one order and their Gauss rule with order + 1 points a side.

    Parameters
    ----------
    order : polynomial order, 1 or 2.
    points, weights : Gauss rule on the unit cube.
    values, gradients : shape functions and their gradients at these points.
    """

    order: int
    points: Float[np.ndarray, "points 3"]
    weights: Float[np.ndarray, " points"]
    values: Float[np.ndarray, "points nodes"]
    gradients: Float[np.ndarray, "points nodes 3"]

    @property
    def nodes(self) -> int:
        """Number of nodes of an element."""
        return (self.order + 1) ** 3

    def evaluate(
        self, local: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n nodes"], Float[np.ndarray, "n nodes 3"]]:
        """Evaluate the shape functions and their gradients at points of the unit cube."""
        return _evaluate(self.order, local)


@cache
def reference_element(order: int) -> ReferenceElement:
    """Return the element of that order."""
    points, weights = get_quadrature(RefHex, 2 * order + 1)
    local = np.ascontiguousarray(points.T)
    return ReferenceElement(order, local, weights, *_evaluate(order, local))


def _evaluate(order: int, local: Float[np.ndarray, "n 3"]) -> tuple[np.ndarray, np.ndarray]:
    element = _ELEMENTS[order]()
    found = [element.lbasis(local.T, int(i)) for i in _tensor_order(order)]
    values = np.stack([np.broadcast_to(value, len(local)) for value, _ in found], axis=1)
    gradients = np.stack([gradient.T for _, gradient in found], axis=1)
    return np.ascontiguousarray(values), np.ascontiguousarray(gradients)


def _tensor_order(order: int) -> Int[np.ndarray, " nodes"]:
    """Indices that put scikit-fem's nodes into tensor order."""
    grid = np.rint(_ELEMENTS[order].doflocs * order).astype(int)
    return np.lexsort(grid.T)
