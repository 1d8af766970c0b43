"""Shape of the body's axis: an arc of constant curvature, or nodes at equal distances."""

import abc
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rodmodel.actuator import Number
from rodmodel.kinematics._integral import integral_weights
from rodmodel.kinematics._rotation import screw

# Samples of an arc: less than half a turn apart, up to eight turns.
ARC_SAMPLES = 17

# Gauss points of the unit interval.
_GAUSS = (0.5 - np.sqrt(3.0) / 6.0, 0.5 + np.sqrt(3.0) / 6.0)
_AXIS = np.array([0.0, 0.0, 1.0])


class Shape(eqx.Module):
    """Pose and curvature along the body, and a quadrature over it."""

    length: eqx.AbstractVar[Number]
    """Length of the body [m]."""

    @abc.abstractmethod
    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Return position r(s) [m] and frame R(s), directors as columns, in the first section's frame."""

    @abc.abstractmethod
    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """Return curvature and twist u(s) [1/m], body frame."""

    @abc.abstractmethod
    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """Return positions [m] and frames along the body, base to end, less than half a turn apart."""

    @abc.abstractmethod
    def samples(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Return curvatures [1/m] at the points of a quadrature over the body, and its weights [m]."""


@final
class Arc(Shape):
    """Constant curvature along the body."""

    base_curvature: Float[Array, "3"]
    length: Number

    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """See `Shape.pose`."""
        return screw(arc_length * self.base_curvature, arc_length * jnp.asarray(_AXIS, arc_length.dtype))

    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """See `Shape.curvature`."""
        del arc_length
        return self.base_curvature

    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """See `Shape.poses`."""
        parts = jnp.linspace(0.0, 1.0, ARC_SAMPLES, dtype=self.base_curvature.dtype)
        return jax.vmap(self.pose)(self.length * parts)

    def samples(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """See `Shape.samples`."""
        return self.base_curvature[None], jnp.asarray([self.length], self.base_curvature.dtype)


@final
class Stepped(Shape):
    """Nodes at equal distances: Hermite's cubic of the curvature between them, the pose by Magnus' expansion.

    A section at the distance h after a node (r₀, R₀), with κ₁, κ₂ the curvatures at the two Gauss points of
    that length, has the pose (r₀, R₀) exp Ω,

        Ω = h (a₁ + a₂)/2 + (√3/12) h² [a₁, a₂],   a = (e₃, κ) in se(3)

    which is of order 4, and exact where the curvature is constant.

    References
    ----------
    Iserles, Munthe-Kaas, Nørsett and Zanna (2000), Acta Numerica 9, 215, sec. 5. Brackets have the opposite
    sign here, as the frame is multiplied from the right.
    """

    positions: Float[Array, "nodes 3"]
    rotations: Float[Array, "nodes 3 3"]
    node_curvatures: Float[Array, "nodes 3"]
    node_slopes: Float[Array, "nodes 3"]
    """Derivative of the curvature by s, from the differential equation [1/m²]."""
    node_drifts: Float[Array, "nodes 3"]
    """Shear part of r', in the frame of the positions."""
    length: Number

    def pose(self, arc_length: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """See `Shape.pose`."""
        node, s = self._place(arc_length)
        first, second = (self._curvature_after(node, s * part) for part in _GAUSS)
        bracket = np.sqrt(3.0) / 12.0 * s * s
        axis = jnp.asarray(_AXIS, arc_length.dtype)
        turn = 0.5 * s * (first + second) + bracket * jnp.cross(first, second)
        shift, rotation = screw(turn, s * axis + bracket * jnp.cross(first - second, axis))
        frame = self.rotations[node]
        return self.positions[node] + frame @ shift + self._drift_up_to(node, s), frame @ rotation

    def curvature(self, arc_length: Float[Array, ""]) -> Float[Array, "3"]:
        """See `Shape.curvature`."""
        return self._curvature_after(*self._place(arc_length))

    def poses(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
        """See `Shape.poses`."""
        return self.positions, self.rotations

    def samples(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """See `Shape.samples`."""
        weights = jnp.asarray(integral_weights(self._steps), self.positions.dtype)
        return self.node_curvatures, self.length * weights

    @property
    def _steps(self) -> int:
        return self.positions.shape[0] - 1

    def _place(self, s: Float[Array, ""]) -> tuple[Int[Array, ""], Float[Array, ""]]:
        """Return the node before a section, and the distance from it [m]."""
        # The factor lifts a section a rounding below a node onto the node.
        part = s / self.length * self._steps * (1.0 + 4.0 * jnp.finfo(s.dtype).eps)
        node = jnp.clip(jnp.floor(part), 0, self._steps).astype(int)
        return node, s - node * (self.length / self._steps)

    def _curvature_after(self, node: Int[Array, ""], distance: Float[Array, ""]) -> Float[Array, "3"]:
        return self._between(self.node_curvatures, self.node_slopes, node, distance)

    def _drift_up_to(self, node: Int[Array, ""], distance: Float[Array, ""]) -> Float[Array, "3"]:
        """Integrate the drift over a distance from a node, by Simpson's rule: exact for a cubic."""
        differences = np.gradient(np.eye(self._steps + 1), axis=0, edge_order=2 if self._steps > 1 else 1)
        slopes = jnp.asarray(differences, distance.dtype) @ self.node_drifts * (self._steps / self.length)
        start, middle, end = (
            self._between(self.node_drifts, slopes, node, part * distance) for part in (0.0, 0.5, 1.0)
        )
        return distance / 6.0 * (start + 4.0 * middle + end)

    def _between(
        self,
        values: Float[Array, "nodes 3"],
        slopes: Float[Array, "nodes 3"],
        node: Int[Array, ""],
        distance: Float[Array, ""],
    ) -> Float[Array, "3"]:
        """Evaluate Hermite's cubic at a distance after a node, from values and slopes by s at the nodes."""
        h = self.length / self._steps
        x, after = distance / h, jnp.minimum(node + 1, self._steps)
        left, right = (1.0 + 2.0 * x) * (1.0 - x) ** 2, x * x * (3.0 - 2.0 * x)
        rise = (1.0 - x) * slopes[node] - x * slopes[after]
        return left * values[node] + right * values[after] + h * x * (1.0 - x) * rise
