"""The shape of the body's axis: an arc of constant curvature, or sections at equal distances."""

import abc
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rodmodel._components import combine, cross, screw_by, triple
from rodmodel._nodes import integral_weights, slope_matrix
from rodmodel._rotation import rotation_of, screw
from rodmodel.calibration_file import Number

# Less than half a turn between two of them, up to eight turns.
ARC_SAMPLES = 17

_GAUSS = (0.5 - np.sqrt(3.0) / 6.0, 0.5 + np.sqrt(3.0) / 6.0)


class Shape(eqx.Module):
    """Pose and curvature along the body, and how to sum over it."""

    length: eqx.AbstractVar[Number]
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
    def samples(self) -> tuple[Float[Array, " n"], Float[Array, "n 3"], Float[Array, " n"]]:
        """Arc lengths [m], curvatures [1/m] there, and the weights [m] that integrate over the body."""


@final
class Arc(Shape):
    """Constant curvature along the body."""

    base_curvature: Float[Array, "3"]
    length: Number

    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Position r(s) [m] and frame R(s), directors as columns; world frame."""
        return screw(self.base_curvature, arc_length)

    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """Curvature and twist u(s) [1/m], body frame."""
        del arc_length
        return self.base_curvature

    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """Positions [m] and frames along the body, base to end, close enough to count the turns."""
        parts = jnp.asarray(np.linspace(0.0, 1.0, ARC_SAMPLES), self.base_curvature.dtype)
        return jax.vmap(self.pose)(self.length * parts)

    def samples(self) -> tuple[Float[Array, " n"], Float[Array, "n 3"], Float[Array, " n"]]:
        """Arc lengths [m], curvatures [1/m] there, and the weights [m] that integrate over the body."""
        dtype = self.base_curvature.dtype
        return jnp.zeros(1, dtype), self.base_curvature[None], jnp.asarray([self.length], dtype)


@final
class Stepped(Shape):
    """Sections at equal distances, curvature between them a cubic, and the pose by Magnus' expansion.

    In a part of the body that starts at (r₀, R₀), with κ₁, κ₂ the curvatures at the two Gauss points of the
    length h up to the section, the pose is (r₀, R₀) exp Ω,

        Ω = h (a₁ + a₂)/2 + (√3/12) h² [a₁, a₂],   a = (e₃, κ) in se(3)

    which is of order 4, and exact where the curvature is constant.

    References
    ----------
    Iserles, Munthe-Kaas, Nørsett and Zanna (2000), Acta Numerica 9, 215, sec. 5; brackets have the sign of a
    frame that is multiplied from the right.
    """

    positions: Float[Array, "nodes 3"]
    quaternions: Float[Array, "nodes 4"]
    node_curvatures: Float[Array, "nodes 3"]
    length: Number
    node_drifts: Float[Array, "nodes 3"] | None = None
    """What shear adds to r', in the frame of the positions; None for nothing."""

    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Position r(s) [m] and frame R(s), directors as columns; world frame."""
        node, h = self._place(arc_length)
        first, second = (triple(self._within(self.node_curvatures, node, h * part)) for part in _GAUSS)
        bracket = np.sqrt(3.0) / 12.0 * h * h
        turn = combine((0.5 * h, first), (0.5 * h, second), (bracket, cross(first, second)))
        change = combine((bracket, first), (-bracket, second))
        w, x, y, z = self.quaternions[node]
        quaternion, shift = screw_by((w, x, y, z), turn, (change[1], -change[0], h))
        position = self.positions[node] + jnp.stack(shift)
        if self.node_drifts is not None:
            ends = self.node_drifts[node], self._within(self.node_drifts, node, h)
            middle = self._within(self.node_drifts, node, 0.5 * h)
            position = position + h / 6.0 * (ends[0] + 4.0 * middle + ends[1])
        return position, rotation_of(jnp.stack(quaternion))

    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """Curvature and twist u(s) [1/m], body frame."""
        return self._within(self.node_curvatures, *self._place(arc_length))

    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """Positions [m] and frames along the body, base to end, close enough to count the turns."""
        return self.positions, jax.vmap(rotation_of)(self.quaternions)

    def samples(self) -> tuple[Float[Array, " n"], Float[Array, "n 3"], Float[Array, " n"]]:
        """Arc lengths [m], curvatures [1/m] there, and the weights [m] that integrate over the body."""
        steps = self.positions.shape[0] - 1
        u = self.node_curvatures
        parts = jnp.asarray(np.linspace(0.0, 1.0, steps + 1), u.dtype)
        return self.length * parts, u, self.length * jnp.asarray(integral_weights(steps), u.dtype)

    def _place(self, s: Float[Array, ""]) -> tuple[Int[Array, ""], Float[Array, ""]]:
        """Node before a section, and the distance from it [m]."""
        steps = self.positions.shape[0] - 1
        # A rounding below a node is the node.
        fraction = s / self.length * steps * (1.0 + 4.0 * jnp.finfo(s.dtype).eps)
        node = jnp.clip(jnp.floor(fraction), 0, steps).astype(int)
        return node, s - node * (self.length / steps)

    def _within(
        self, values: Float[Array, "nodes 3"], node: Int[Array, ""], distance: Float[Array, ""]
    ) -> Float[Array, "3"]:
        """Values at the nodes, at a distance after one of them: Hermite's cubic."""
        steps = self.positions.shape[0] - 1
        h, after = self.length / steps, jnp.minimum(node + 1, steps)
        x = distance / h
        start, end = values[node], values[after]
        slopes = jnp.asarray(slope_matrix(steps) / steps, x.dtype)
        rise = slopes[node] @ values, slopes[after] @ values
        left, right = (1.0 + 2.0 * x) * (1.0 - x) ** 2, x * x * (3.0 - 2.0 * x)
        return left * start + right * end + x * (1.0 - x) * ((1.0 - x) * rise[0] - x * rise[1])
