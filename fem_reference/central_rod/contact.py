"""Frictionless unilateral contact between the cavity's wall and the rod's curve.

Contact acts at the Gauss points of the wall's facets. The gap of a point is its distance from the curve minus
its distance at rest, which on a flat facet is slightly less than the rod's radius; `barrier` acts on the gap.
Contact at the nodes alone would be unstable: the chords between nodes lie within the rod, and nodes of a
strongly pressed wall would slide together around it. Lengths mm, pressures MPa.
"""

import numpy as np
from jaxtyping import Float, Int

from fem_reference.central_rod.barrier import ACTIVATION, INSIDE_SHARE, REST_SHARE, barrier
from fem_reference.central_rod.closest_point import ClosestPoints, windows
from fem_reference.central_rod.spline_rod import SplineBasis
from fem_reference.errors import NewtonError


class CoreContact:
    """Facets of the cavity's wall and the control points of the rod's curve.

    Parameters
    ----------
    facets : nodes of each facet.
    values : shape functions of a facet's nodes at its Gauss points.
    areas : reference area of each Gauss point [mm²].
    points : positions of all nodes at rest [mm].
    basis : spline basis of the curve.
    first_control : index of the first control point among all positions.
    """

    def __init__(
        self,
        facets: Int[np.ndarray, "facets own"],
        values: Float[np.ndarray, "gauss own"],
        areas: Float[np.ndarray, "facets gauss"],
        points: Float[np.ndarray, "nodes 3"],
        basis: SplineBasis,
        first_control: int,
    ) -> None:
        places = np.einsum("qa,fai->qfi", values, points[facets])
        stations = places[:, :, 2]
        window = windows(basis, stations.min(axis=0), stations.max(axis=0))
        self._points = [
            ClosestPoints(facets, shares, at, basis, window, first_control)
            for shares, at in zip(values, stations, strict=True)
        ]
        self._radii = np.linalg.norm(places[:, :, :2], axis=2)
        self._areas = areas.T
        #: Nodes of each facet and its window of control points.
        self.connectivity = self._points[0].connectivity

    def gap(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "gauss facets"]:
        """Return each point's gap [mm]; slightly negative under pressure."""
        return np.array([points.distance(positions) for points in self._points]) - self._radii

    def admissible(self, positions: Float[np.ndarray, "all 3"]) -> bool:
        """Return whether all points are well outside the axis and near their stations."""
        try:
            gap = self.gap(positions)
        except NewtonError:
            return False
        return bool((gap > -INSIDE_SHARE * self._radii).all())

    def pressure(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "gauss facets"]:
        """Return the pressure on the rod at each point, per reference area [MPa]."""
        _, slope, _ = _law(self.gap(positions))
        return -slope

    def energy(self, positions: Float[np.ndarray, "all 3"]) -> float:
        """Return the energy of contact [N mm]."""
        energy, *_ = _law(self.gap(positions))
        return float((self._areas * energy).sum())

    def force(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "facets dofs"]:
        """Return only the forces of `response`."""
        force = np.zeros((len(self.connectivity), 3 * self.connectivity.shape[1]))
        for points, radii, areas in zip(self._points, self._radii, self._areas, strict=True):
            distance, normal = points.normal(positions)
            _, first, _ = _law(distance - radii)
            force += (areas * first)[:, None] * normal
        return force

    def response(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, "facets dofs"], Float[np.ndarray, "facets dofs dofs"]]:
        """Return forces and tangents on each facet's nodes and window."""
        blocks, own = self.connectivity.shape
        force, vectors, factors, isotropic = np.zeros((blocks, 3 * own)), [], [], np.zeros((blocks, own, own))
        for points, radii, areas in zip(self._points, self._radii, self._areas, strict=True):
            bent = points.bent(positions)
            _, first, second = _law(bent.distance - radii)
            force += (areas * first)[:, None] * bent.normal
            share = areas * first / bent.distance
            isotropic += (share[:, None] * bent.weight)[:, :, None] * bent.weight[:, None, :]
            vectors += [bent.normal, bent.mixed]
            factors += [areas * second - share, -share / bent.bend]
        stiffness = _outer(vectors, factors).reshape(blocks, own, 3, own, 3)
        for i in range(3):
            stiffness[:, :, i, :, i] += isotropic
        return force, stiffness.reshape(blocks, 3 * own, 3 * own)

    def concave_part(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "facets dofs dofs"]:
        """Return the negative part of the tangents from the rod's curvature: a pressed point slides off it.

        It acts on motion around the rod only. Along the rod the tangents are unchanged: there the contact
        forces rotate with the rod, which carries loads of the whole body.
        """
        moves, factors = [], []
        for points, radii, areas in zip(self._points, self._radii, self._areas, strict=True):
            distance, move = points.around(positions)
            _, first, _ = _law(distance - radii)
            moves.append(move)
            factors.append(areas * first / distance)
        return _outer(moves, factors)


def _outer(
    vectors: list[Float[np.ndarray, "facets dofs"]], factors: list[Float[np.ndarray, " facets"]]
) -> Float[np.ndarray, "facets dofs dofs"]:
    """Return the sum of the vectors' outer products with themselves, times the factors."""
    rows = np.stack(vectors, axis=1)
    scaled = np.stack(factors, axis=1)[:, :, None] * rows
    product: np.ndarray = np.swapaxes(scaled, 1, 2) @ rows
    return product


def _law(gap: Float[np.ndarray, "..."]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the energy per area and its first two derivatives by the gap."""
    return barrier(gap + REST_SHARE * ACTIVATION)
