"""Force and moment on the cap's outer face, distributed over its nodes.

With w_a the share of node a in the face's area, x̄ = Σ w_a x_a and r_a = x_a − x̄, the nodal forces

    f_a = w_a [F + (I⁻¹M) × r_a],   I = Σ w_a (|r_a|² 1 − r_a r_aᵀ)

have the resultants F at x̄ and M, and do the work F·δx̄ + M·δω on the face's mean rotation
δω = I⁻¹ Σ w_a r_a × δx_a.
Dead loads keep their direction in the world; follower loads rotate with the face. The load stiffness is that
of a rigidly rotating face: not symmetric, of rank three. It is kept apart from the sparse stiffness, as three
columns and three rows, and included by the Woodbury formula. Lengths mm, forces N.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from fem_reference.rotations import cross_matrix, nearest_rotation


@dataclass(frozen=True)
class TipFrame:
    """Mean pose of the face, with the arms and inertia that give its rotation.

    Parameters
    ----------
    position : centre x̄ [mm].
    rotation : rotation from rest.
    arms : r_a [mm].
    inverse_inertia : I⁻¹ [1/mm²].
    """

    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    arms: Float[np.ndarray, "face 3"]
    inverse_inertia: Float[np.ndarray, "3 3"]


class TipFace:
    """The cap's outer face.

    Parameters
    ----------
    nodes : nodes of the face.
    areas : reference area of each node [mm²].
    rest : reference positions of all points [mm].
    """

    def __init__(
        self,
        nodes: Int[np.ndarray, " face"],
        areas: Float[np.ndarray, " face"],
        rest: Float[np.ndarray, "points 3"],
    ) -> None:
        self.nodes = nodes
        self.weights = areas / areas.sum()
        self._rest_arms = rest[nodes] - self.weights @ rest[nodes]

    def frame(self, positions: Float[np.ndarray, "points 3"]) -> TipFrame:
        """Return the mean position, and the rotation that fits the nodes in least squares (Kabsch 1976)."""
        x = positions[self.nodes]
        centre = self.weights @ x
        arms = x - centre
        weighted = self.weights[:, None] * arms
        inertia = np.eye(3) * float((weighted * arms).sum()) - weighted.T @ arms
        return TipFrame(centre, nearest_rotation(weighted.T @ self._rest_arms), arms, np.linalg.inv(inertia))

    def forces(
        self, frame: TipFrame, force: Float[np.ndarray, "3"], moment: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "face 3"]:
        """Return the nodal forces of resultants in the world frame."""
        return self.weights[:, None] * (force + np.cross(frame.inverse_inertia @ moment, frame.arms))

    def stiffness_columns(
        self,
        frame: TipFrame,
        force: Float[np.ndarray, "3"],
        moment: Float[np.ndarray, "3"],
        follower: bool,
    ) -> Float[np.ndarray, "face 3 3"]:
        """Return the change of the nodal forces per component of the face's rotation."""
        nodal = self.forces(frame, force, moment)
        columns = np.empty((len(self.nodes), 3, 3))
        for k, turn in enumerate(np.eye(3)):
            # All forces rotate with the face; a dead load is rotated back.
            columns[:, :, k] = np.cross(turn, nodal)
            if not follower:
                columns[:, :, k] -= self.forces(frame, np.cross(turn, force), np.cross(turn, moment))
        return columns

    def rotation_rows(self, frame: TipFrame) -> Float[np.ndarray, "3 face 3"]:
        """Return ∂ω/∂x_a, the rotation of the face by displacements of its nodes."""
        cross = np.stack([cross_matrix(arm) for arm in frame.arms])
        return np.einsum("a,ij,ajk->iak", self.weights, frame.inverse_inertia, cross)
