"""The shape of the body's axis: an arc of constant curvature, or a polynomial through nodes."""

import abc
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel._nodes import DEGREE, TO_COEFFICIENTS, WEIGHTS
from rodmodel._rotation import rotation_of, screw

# Less than half a turn between two of them, up to eight turns.
_ARC_SAMPLES = 17


class Shape(eqx.Module):
    """Pose and curvature along the body, and how to sum over it."""

    length: eqx.AbstractVar[float]
    """Of the body [m]."""

    @abc.abstractmethod
    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Position r(s) [m] and frame R(s), directors as columns; world frame."""

    @abc.abstractmethod
    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """Curvature and twist u(s) [1/m], body frame."""

    @abc.abstractmethod
    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """Positions [m] and frames along the body, base to end, close enough to count the turns."""

    @abc.abstractmethod
    def curvatures(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Curvatures [1/m] and the weights [m] that integrate a function of them over the body."""


@final
class Arc(Shape):
    """Constant curvature along the body."""

    base_curvature: Float[Array, "3"]
    length: float = eqx.field(static=True)

    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Position r(s) [m] and frame R(s), directors as columns; world frame."""
        return screw(self.base_curvature, arc_length)

    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """Curvature and twist u(s) [1/m], body frame."""
        del arc_length
        return self.base_curvature

    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """Positions [m] and frames along the body, base to end, close enough to count the turns."""
        samples = jnp.asarray(np.linspace(0.0, self.length, _ARC_SAMPLES), self.base_curvature.dtype)
        return jax.vmap(self.pose)(samples)

    def curvatures(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Curvatures [1/m] and the weights [m] that integrate a function of them over the body."""
        weights = jnp.asarray([self.length], self.base_curvature.dtype)
        return self.base_curvature[None], weights


@final
class Polynomial(Shape):
    """Polynomials through the states at the Chebyshev points of the body."""

    positions: Float[Array, "nodes 3"]
    quaternions: Float[Array, "nodes 4"]
    node_curvatures: Float[Array, "nodes 3"]
    length: float = eqx.field(static=True)

    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Position r(s) [m] and frame R(s), directors as columns; world frame."""
        basis = self._basis(arc_length)
        return basis @ self.positions, rotation_of(basis @ self.quaternions)

    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """Curvature and twist u(s) [1/m], body frame."""
        return self._basis(arc_length) @ self.node_curvatures

    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """Positions [m] and frames along the body, base to end, close enough to count the turns."""
        return self.positions, jax.vmap(rotation_of)(self.quaternions)

    def curvatures(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Curvatures [1/m] and the weights [m] that integrate a function of them over the body."""
        return self.node_curvatures, jnp.asarray(self.length * WEIGHTS, self.positions.dtype)

    def _basis(self, arc_length: Float[Array, ""]) -> Float[Array, " nodes"]:
        """Values at an arc length of the Lagrange polynomials of the nodes."""
        x = 2.0 * arc_length / self.length - 1.0
        chebyshev = [jnp.ones_like(x), x]
        for _ in range(DEGREE - 1):
            chebyshev.append(2.0 * x * chebyshev[-1] - chebyshev[-2])
        return jnp.stack(chebyshev) @ jnp.asarray(TO_COEFFICIENTS, x.dtype)
