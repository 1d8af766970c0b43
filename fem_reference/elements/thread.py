"""Thread embedded in the host mesh: straight elastic segments whose end points move with the hexahedra.

A segment of rest length L0 has the energy EA/2 L0 (l/L0 − 1)². In compression a yarn that goes slack has only
a fraction of it; with the full stiffness the chain of bars buckles, the sooner the shorter its segments.
Lengths mm, forces N.

The displacement of a thread point is interpolated from the host's nodes, as in the paper's embedded elements:
on the thread's axis, or as the mean over its circumference. On the axis the result does not converge: under a
line load the displacement of a solid grows without bound as elements shrink, like the logarithm of their
size. The mean over the circumference of a thread of finite radius converges; the two agree while elements
are much larger than the thread.

References
----------
D'Angelo and Quarteroni (2008), On the coupling of 1D and 3D diffusion-reaction equations, Math. Models
Methods Appl. Sci. 18. Steinbrecher et al. (2020), A mortar-type finite element approach for embedding 1D
beams into 3D solid volumes, Comput. Mech. 66.
"""

import numpy as np
from jaxtyping import Bool, Float

from fem_reference.geometry import SI, Thread, Units, Winding
from fem_reference.mesh import BodyMesh, embed_circles, embed_points, merged


class ThreadSegments:
    """All segments of a winding in a mesh.

    Parameters
    ----------
    mesh : host mesh [mm]; it contains the threads' circumferences, which are flattened at its end faces.
    winding, thread : layout, and elasticity of the thread.
    radius, length : radius and length of the winding's cylinder [m].
    points_per_turn : segments per turn of a helix or per ring; about one per node interval.
    start : height at which the winding begins [m].
    units : of the mesh, and of forces.

    Raises
    ------
    ValueError
        If threads overlap or leave the mesh.
    """

    def __init__(
        self,
        mesh: BodyMesh,
        winding: Winding,
        thread: Thread,
        radius: float,
        length: float,
        points_per_turn: int,
        start: float = 0.0,
        units: Units = SI,
    ) -> None:
        winding.refuse_overlap(thread)
        self.axial_stiffness = thread.axial_stiffness / units.newton
        self._slack_share = thread.slack_share
        hosts, weights, self.polylines = [], [], []
        count = 0
        pairs = []
        for line in winding.polylines(radius, length, points_per_turn, start):
            points = line * units.metre
            if thread.coupling == "circumference":
                host, weight = embed_circles(mesh, points, thread.radius * units.metre)
            else:
                host, weight = embed_points(mesh, points)
            hosts.append(host)
            weights.append(weight)
            index = count + np.arange(len(points))
            pairs.append(np.column_stack([index[:-1], index[1:]]))
            self.polylines.append(index)
            count += len(points)
        #: Host nodes of every point, and their weights.
        self.host = np.concatenate(hosts) if hosts else np.empty((0, 8), int)
        self.weight = np.concatenate(weights) if weights else np.empty(self.host.shape)
        #: The two points of every segment.
        self.segments = ends = np.concatenate(pairs) if pairs else np.empty((0, 2), int)
        # x_b − x_a = Σ_c coefficient_c x_c over the host nodes of both ends.
        self.connectivity = self.host[ends].reshape(len(ends), 2 * self.host.shape[1])
        self._coefficient = np.concatenate([-self.weight[ends[:, 0]], self.weight[ends[:, 1]]], axis=1)
        if thread.coupling == "circumference":
            self.connectivity, self._coefficient = merged(self.connectivity, self._coefficient)
        #: Host nodes without weight that pad short rows of ``connectivity``.
        self.padding = self._coefficient == 0.0
        self.rest_length = np.linalg.norm(self._span(mesh.points), axis=1)

    def __len__(self) -> int:
        return len(self.connectivity)

    def points(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "points 3"]:
        """Current positions of the thread's points [mm], indexed by ``polylines``."""
        return np.einsum("pa,pai->pi", self.weight, positions[self.host])

    def _span(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "segments 3"]:
        return np.einsum("sc,sci->si", self._coefficient, positions[self.connectivity])

    def _strain(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, " segments"]:
        return np.linalg.norm(self._span(positions), axis=1) / self.rest_length - 1.0

    def slack(self, tension: Float[np.ndarray, " segments"]) -> Bool[np.ndarray, " segments"]:
        """Return which segments are slack, by the sign of their strain or tension; bars never are."""
        return (tension < 0.0) & (self._slack_share < 1.0)

    def stiffness(self, sign: Float[np.ndarray, " segments"]) -> Float[np.ndarray, " segments"]:
        """Return the axial stiffness of every segment [N]: EA, or its fraction for a slack segment."""
        return np.where(self.slack(sign), self._slack_share, 1.0) * self.axial_stiffness

    def tension(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, " segments"]:
        """Return the constitutive tension [N]."""
        strain = self._strain(positions)
        return self.stiffness(strain) * strain

    def tension_after(
        self,
        positions: Float[np.ndarray, "nodes 3"],
        tension: Float[np.ndarray, " segments"],
        stretch: Float[np.ndarray, " segments"],
    ) -> Float[np.ndarray, " segments"]:
        """Return the tensions after a Newton step [N].

        Parameters
        ----------
        positions : positions at the start of the step [mm].
        tension : tensions there, whose sign says which segments are taut [N].
        stretch : elongation of the segments in the step [mm].
        """
        linear = self.stiffness(tension) * (self._strain(positions) + stretch / self.rest_length)
        # A segment that goes slack keeps its strain; one that becomes taut, its force.
        return np.where((tension >= 0.0) & (linear < 0.0), self._slack_share * linear, linear)

    def loosened(self, tension: Float[np.ndarray, " segments"]) -> Float[np.ndarray, " segments"]:
        """Return extrapolated tensions, with negative ones reduced where segments go slack."""
        return np.where(self.slack(tension), self._slack_share * tension, tension)

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Return the stretch energy [N mm]."""
        return float(0.5 * (self.tension(positions) * self._strain(positions) * self.rest_length).sum())

    def force(
        self, positions: Float[np.ndarray, "nodes 3"], tension: Float[np.ndarray, " segments"] | None = None
    ) -> Float[np.ndarray, "segments dofs"]:
        """Return only the forces of `response` on the host nodes, at the same ``tension``."""
        span = self._span(positions)
        length = np.linalg.norm(span, axis=1)
        strain = length / self.rest_length - 1.0
        stiffness = self.stiffness(strain if tension is None else tension)
        pull = (stiffness * strain / length)[:, None] * span
        local = self._coefficient[:, :, None] * pull[:, None, :]
        return local.reshape(len(self), 3 * self.connectivity.shape[1])

    def response(
        self, positions: Float[np.ndarray, "nodes 3"], tension: Float[np.ndarray, " segments"] | None = None
    ) -> tuple[
        Float[np.ndarray, "segments dofs"],
        Float[np.ndarray, "segments dofs dofs"],
        Float[np.ndarray, "segments dofs"],
    ]:
        """Return forces, tangents and ∂l/∂x of the segments on their host nodes.

        Parameters
        ----------
        positions : current positions of the nodes [mm].
        tension : tension in the geometric part of the tangent [N]; the constitutive one by default, which
            gives the exact Hessian. Its sign selects the branch of the law, taut or slack.
        """
        span = self._span(positions)
        length = np.linalg.norm(span, axis=1)
        direction = span / length[:, None]
        strain = length / self.rest_length - 1.0
        axial = self.stiffness(strain if tension is None else tension)
        constitutive = axial * strain
        if tension is None:
            tension = constitutive
        size = 3 * self.connectivity.shape[1]
        length_gradient = (self._coefficient[:, :, None] * direction[:, None, :]).reshape(len(self), size)
        force = constitutive[:, None] * length_gradient
        geometric = (tension / length)[:, None, None] * np.eye(3) + (
            axial / self.rest_length - tension / length
        )[:, None, None] * (direction[:, :, None] * direction[:, None, :])
        # ∂span/∂x multiplies as matrices on both sides: an outer product would have inner loops of length 3.
        spread = (self._coefficient[:, :, None, None] * np.eye(3)).reshape(len(self), size, 3)
        stiffness = (spread @ geometric) @ np.swapaxes(spread, 1, 2)
        return force, stiffness, length_gradient
