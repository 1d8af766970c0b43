"""Frictionless unilateral contact between the cavity's wall and the core, the central rod.

The core is a tube of constant curvature around the axis c(s; y), the translation of exp(s·(λ e3, u)) with the
strain y = (u, λ). A node's gap is its distance to the axis less the core's radius; it depends on the node and
on y. The wall may leave the core; the barrier of `central_rod` keeps it outside. Lengths mm, pressures MPa.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from fem_reference.cell.screw_motion import ScrewSeries
from fem_reference.central_rod import ACTIVATION, INSIDE_SHARE, REST_SHARE, barrier
from fem_reference.elements import Forces, Own, Response


@dataclass(frozen=True)
class CoreContactResponse:
    """Contact energy [N mm] with its derivatives in the nodes and in the strain (u, λ).

    ``node_concave`` is the part of ``node_stiffness`` that comes from the core's curvature: a node pressed on
    the core slides off.
    """

    energy: float
    node_force: Float[np.ndarray, "contacts 3"]
    node_stiffness: Float[np.ndarray, "contacts 3 3"]
    node_concave: Float[np.ndarray, "contacts 3 3"]
    strain_force: Float[np.ndarray, "4"]
    node_strain: Float[np.ndarray, "contacts 3 4"]
    strain_stiffness: Float[np.ndarray, "4 4"]


class CoreContactGroup:
    """A `CoreContactResponse` as a force group of the nodes, at the positions and the strain of the response.

    Parameters
    ----------
    nodes : of the contact.
    response : evaluated there.
    """

    padding = None

    def __init__(self, nodes: Int[np.ndarray, " contacts"], response: CoreContactResponse) -> None:
        self.connectivity = nodes[:, None]
        self._evaluated = response

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """See `ForceGroup.energy`."""
        return self._evaluated.energy

    def force(self, positions: Float[np.ndarray, "nodes 3"], own: Own | None) -> Forces:
        """See `ForceGroup.force`."""
        return Forces(self._evaluated.node_force)

    def response(self, positions: Float[np.ndarray, "nodes 3"], own: Own | None) -> Response:
        """See `ForceGroup.response`."""
        return Response(self._evaluated.node_force, self._evaluated.node_stiffness)


class CellCoreContact:
    """The cavity's nodes against the core.

    Parameters
    ----------
    nodes : indices of the cavity's nodes.
    areas : reference area of each [mm²].
    radius : of the core [mm].
    stations : reference z of each node [mm]; the search for its closest point on the axis starts there.
    """

    def __init__(
        self,
        nodes: Int[np.ndarray, " contacts"],
        areas: Float[np.ndarray, " contacts"],
        radius: float,
        stations: Float[np.ndarray, " contacts"],
    ) -> None:
        self.nodes = nodes
        self._areas = areas
        self._radius = radius
        self._stations = stations

    def gap(
        self, positions: Float[np.ndarray, "nodes 3"], series: ScrewSeries
    ) -> Float[np.ndarray, " contacts"]:
        """Distance from the core's surface to each node [mm]; slightly negative under contact pressure."""
        offset, *_ = self._closest(positions[self.nodes], series)
        return np.linalg.norm(offset, axis=1) - self._radius

    def admissible(self, positions: Float[np.ndarray, "nodes 3"], series: ScrewSeries) -> bool:
        """Whether every node is on its own side of the axis, with a margin."""
        return bool((self.gap(positions, series) > -INSIDE_SHARE * self._radius).all())

    def response(self, positions: Float[np.ndarray, "nodes 3"], series: ScrewSeries) -> CoreContactResponse:
        """Energy and derivatives; the closest point's motion along the axis is condensed."""
        x = positions[self.nodes]
        offset, s, tangent, bend = self._closest(x, series)
        powers = s[:, None] ** np.arange(len(series.value))
        slopes = np.zeros_like(powers)
        slopes[:, 1:] = powers[:, :-1] * np.arange(1, powers.shape[1])
        axis_y = np.einsum("nk,kui->niu", powers, series.first[:, :, :3, 3])
        tangent_y = np.einsum("nk,kui->niu", slopes, series.first[:, :, :3, 3])
        axis_yy = np.einsum("nk,kuvi->niuv", powers, series.second[:, :, :, :3, 3])

        # D = ½|x − c(s; u)|² and its derivatives in (x, y); s is stationary.
        count = len(x)
        gradient = np.concatenate([offset, -np.einsum("ni,niu->nu", offset, axis_y)], axis=1)
        hessian = np.zeros((count, 7, 7))
        hessian[:, :3, :3] = np.eye(3)
        hessian[:, :3, 3:] = -axis_y
        hessian[:, 3:, :3] = -np.swapaxes(axis_y, 1, 2)
        hessian[:, 3:, 3:] = np.einsum("niu,niv->nuv", axis_y, axis_y) - np.einsum(
            "ni,niuv->nuv", offset, axis_yy
        )
        mixed = np.concatenate(
            [-tangent, np.einsum("ni,niu->nu", tangent, axis_y) - np.einsum("ni,niu->nu", offset, tangent_y)],
            axis=1,
        )
        hessian -= mixed[:, :, None] * mixed[:, None, :] / bend[:, None, None]

        distance = np.linalg.norm(offset, axis=1)
        gap_gradient = gradient / distance[:, None]
        gap_hessian = (hessian - gap_gradient[:, :, None] * gap_gradient[:, None, :]) / distance[
            :, None, None
        ]
        energy, slope, curve = barrier(distance - self._radius + REST_SHARE * ACTIVATION)
        force = (self._areas * slope)[:, None] * gap_gradient
        stiffness = self._areas[:, None, None] * (
            slope[:, None, None] * gap_hessian
            + curve[:, None, None] * gap_gradient[:, :, None] * gap_gradient[:, None, :]
        )
        return CoreContactResponse(
            energy=float((self._areas * energy).sum()),
            node_force=force[:, :3],
            node_stiffness=stiffness[:, :3, :3],
            node_concave=(self._areas * slope)[:, None, None] * gap_hessian[:, :3, :3],
            strain_force=force[:, 3:].sum(axis=0),
            node_strain=stiffness[:, :3, 3:],
            strain_stiffness=stiffness[:, 3:, 3:].sum(axis=0),
        )

    def pressure(
        self, positions: Float[np.ndarray, "nodes 3"], series: ScrewSeries
    ) -> Float[np.ndarray, " contacts"]:
        """Contact pressure on the core at each node, per reference area [MPa]."""
        return -barrier(self.gap(positions, series) + REST_SHARE * ACTIVATION)[1]

    def _closest(
        self, x: Float[np.ndarray, "contacts 3"], series: ScrewSeries
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Offset from the closest point of the axis, its station, the tangent there and ∂²D/∂s²."""
        axis = series.value[:, :3, 3]
        orders = np.arange(len(axis))
        s = self._stations.copy()
        for _ in range(20):
            powers = s[:, None] ** orders
            slopes = np.zeros_like(powers)
            slopes[:, 1:] = powers[:, :-1] * orders[1:]
            curves = np.zeros_like(powers)
            curves[:, 2:] = powers[:, :-2] * (orders[2:] * orders[1:-1])
            offset = x - powers @ axis
            tangent = slopes @ axis
            residual = np.einsum("ni,ni->n", offset, tangent)
            bend = np.einsum("ni,ni->n", tangent, tangent) - np.einsum("ni,ni->n", offset, curves @ axis)
            if np.abs(residual).max() < 1e-14:
                break
            s = s + residual / bend
        return offset, s, tangent, bend
