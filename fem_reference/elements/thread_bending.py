"""Bending stiffness of the thread at the joints of its segments, for a solid wire.

A joint between two segments of mean rest length ℓ, with turning angle φ, has the energy of a plane elastica,

    EI/(2 ℓ) (κ − κ₀)²,   κ = 2 tan(φ/2),

which is zero as wound. Twist has no energy, so the plane of bending turns freely about the thread. Lengths
mm, forces N.

References
----------
Bergou et al. (2008), Discrete elastic rods, ACM Trans. Graph. 27, for the curvature of a joint.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, Int

from fem_reference.elements.thread import ThreadSegments
from fem_reference.mesh import merged

# A line whose ends are closer than this is a ring [mm].
_CLOSED = 1e-6


class ThreadBending:
    """All joints between a winding's segments.

    Parameters
    ----------
    thread : segments in their mesh.
    rest : reference positions of the mesh's nodes [mm].
    bending_stiffness : EI [N mm²].
    is_periodic : True if open threads continue in the next period. No joint is built across the cut; the
        stiffness of the remaining joints is scaled by segments/joints to keep the total bending energy.
    """

    def __init__(
        self,
        thread: ThreadSegments,
        rest: Float[np.ndarray, "nodes 3"],
        bending_stiffness: float,
        is_periodic: bool = False,
    ) -> None:
        places = thread.points(rest)
        joints, shares = [np.empty((0, 3), int)], [np.empty(0)]
        for line in thread.polylines:
            own = _joints(line, bool(np.linalg.norm(places[line[0]] - places[line[-1]]) < _CLOSED))
            joints.append(own)
            shares.append(np.full(len(own), (len(line) - 1) / len(own) if is_periodic else 1.0))
        points, share = np.concatenate(joints), np.concatenate(shares)
        hosts = thread.host[points].reshape(len(points), 3 * thread.host.shape[1])
        weight = thread.weight[points]
        # Both spans as sums over the host nodes of the three points.
        none = np.zeros_like(weight[:, 0])
        spans = [
            np.concatenate([-weight[:, 0], weight[:, 1], none], axis=1),
            np.concatenate([none, -weight[:, 1], weight[:, 2]], axis=1),
        ]
        (self.connectivity, first), (_, second) = (merged(hosts, span) for span in spans)
        self._coefficient = np.stack([first, second], axis=1)
        #: Host nodes without weight that pad short rows of ``connectivity``.
        self.padding = (self._coefficient == 0.0).all(axis=1)
        at_rest = self._spans(rest)
        self._turning = _turnings(at_rest)
        self._stiffness = share * bending_stiffness / np.linalg.norm(at_rest, axis=2).mean(axis=1)

    def __len__(self) -> int:
        return len(self.connectivity)

    def _spans(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "joints 2 3"]:
        return np.einsum("jsc,jci->jsi", self._coefficient, positions[self.connectivity])

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Return the bending energy [N mm]."""
        return float(_energies(self._spans(positions), self._turning, self._stiffness).sum())

    def force(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "joints dofs"]:
        """Return only the forces of `response` on the host nodes."""
        slope = _slopes(self._spans(positions), self._turning, self._stiffness)
        return np.einsum("jsc,jsi->jci", self._coefficient, slope).reshape(len(self), -1)

    def response(
        self, positions: Float[np.ndarray, "nodes 3"]
    ) -> tuple[Float[np.ndarray, "joints dofs"], Float[np.ndarray, "joints dofs dofs"]]:
        """Return forces and tangents of the joints on their host nodes."""
        curve = _curves(self._spans(positions), self._turning, self._stiffness)
        count, size = len(self), 3 * self.connectivity.shape[1]
        spread = np.einsum("jsc,ik->jcisk", self._coefficient, np.eye(3)).reshape(count, size, 6)
        stiffness = (spread @ curve.reshape(count, 6, 6)) @ np.swapaxes(spread, 1, 2)
        return self.force(positions), stiffness


def _joints(line: Int[np.ndarray, " points"], closed: bool) -> Int[np.ndarray, "joints 3"]:
    """Return the points before, at and after every joint of a line."""
    inner = np.column_stack([line[:-2], line[1:-1], line[2:]])
    return np.vstack([inner, [line[-2], line[-1], line[1]]]) if closed else inner


def _turning(spans: Float[Array, "2 3"]) -> Float[Array, ""]:
    """Return 2 tan(φ/2) for the angle φ between two spans."""
    first, second = spans
    lengths = jnp.sqrt((first @ first) * (second @ second))
    return 2.0 * jnp.linalg.norm(jnp.cross(first, second)) / (lengths + first @ second)


def _energy(
    spans: Float[Array, "2 3"], turning: Float[Array, ""], stiffness: Float[Array, ""]
) -> Float[Array, ""]:
    return 0.5 * stiffness * (_turning(spans) - turning) ** 2


def _of_joints(function: Callable[..., Array]) -> Callable[..., np.ndarray]:
    """Vectorise a function over all joints, in double precision whatever the process default."""
    compiled = jax.jit(jax.vmap(function))

    def call(*arguments: np.ndarray) -> np.ndarray:
        with jax.enable_x64(True):
            return np.asarray(compiled(*arguments))

    return call


_turnings = _of_joints(_turning)
_energies = _of_joints(_energy)
_slopes = _of_joints(jax.grad(_energy))
_curves = _of_joints(jax.hessian(_energy))
