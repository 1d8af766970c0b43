"""Bond of the cavity's wall to the rod's curve, by a penalty.

At each node the penalty acts on the gap and on the slip along the curve, (x − c(s₀))·c'(s₀), with s₀ the
node's station at rest. Rotation about the rod is free, as the rod's torsion has no energy. Lengths mm,
pressures MPa.
"""

import numpy as np
from jaxtyping import Float, Int

from fem_reference.central_rod.closest_point import ClosestPoints, isotropic, rows, windows
from fem_reference.central_rod.spline_rod import SplineBasis

# Penalty of the bond [MPa/mm]: 500 times the stiffness of the inner wall, 0.3 MPa over 1.5 mm.
BOND_STIFFNESS = 100.0


class CoreBond:
    """Bonded nodes of the cavity's wall and the control points of the rod's curve.

    Parameters
    ----------
    nodes : indices of the bonded nodes.
    areas : reference area of each node [mm²].
    stations : reference z of each node [mm].
    radius : radius of the rod [mm].
    basis : spline basis of the curve.
    first_control : index of the first control point among all positions.
    """

    def __init__(
        self,
        nodes: Int[np.ndarray, " nodes"],
        areas: Float[np.ndarray, " nodes"],
        stations: Float[np.ndarray, " nodes"],
        radius: float,
        basis: SplineBasis,
        first_control: int,
    ) -> None:
        window = windows(basis, stations, stations)
        self._points = ClosestPoints(nodes[:, None], np.ones(1), stations, basis, window, first_control)
        self._penalty = BOND_STIFFNESS * areas
        self._radius = radius
        self._value, self._slope = (self._points.local(stations, order) for order in (0, 1))
        #: Each node and its window of control points.
        self.connectivity = self._points.connectivity

    def energy(self, positions: Float[np.ndarray, "all 3"]) -> float:
        """Return the energy of the bond [N mm]."""
        gap = self._points.distance(positions) - self._radius
        slip, *_ = self._slip(positions)
        return float(0.5 * self._penalty @ (gap**2 + slip**2))

    def force(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "nodes dofs"]:
        """Return only the forces of `response`."""
        distance, normal = self._points.normal(positions)
        slip, along, _ = self._slip(positions)
        gap = distance - self._radius
        return (self._penalty * gap)[:, None] * normal + (self._penalty * slip)[:, None] * along

    def response(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, "nodes dofs"], Float[np.ndarray, "nodes dofs dofs"]]:
        """Return forces and tangents on each node and its window."""
        distance, normal, curvature = self._points.curvature(positions)
        slip, along, turning = self._slip(positions)
        gap = distance - self._radius
        stiffness = normal[:, :, None] * normal[:, None, :] + gap[:, None, None] * curvature
        stiffness += along[:, :, None] * along[:, None, :] + slip[:, None, None] * turning
        force = gap[:, None] * normal + slip[:, None] * along
        return self._penalty[:, None] * force, self._penalty[:, None, None] * stiffness

    def _slip(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, " nodes"], Float[np.ndarray, "nodes dofs"], np.ndarray]:
        """Return the slip (x − c(s₀))·c'(s₀) and its first two derivatives by y = (x, P)."""
        points = self._points
        offset = points.places(positions) - points.on_curve(positions, self._value)
        tangent = points.on_curve(positions, self._slope)
        weight = points.weight(self._value)
        turn = np.concatenate([np.zeros((len(offset), 1)), self._slope], axis=1)
        gradient = weight[:, :, None] * tangent[:, None, :] + turn[:, :, None] * offset[:, None, :]
        both = weight[:, :, None] * turn[:, None, :]
        return (
            np.einsum("ni,ni->n", offset, tangent),
            rows(gradient),
            isotropic(both + np.swapaxes(both, 1, 2)),
        )
