"""The cavity's wall against the rod's curve: frictionless unilateral contact, or a bond.

A node's gap is its distance to the curve less the rod's radius. Where the wall is free, the barrier of
`interface` acts on it. Where it is bonded, a penalty holds the gap and the slip along the curve at zero, slip
being (x − c(s₀))·c'(s₀) with s₀ the node's station at rest; turning about the rod stays free, as the rod's
torsion has no energy. Lengths mm, pressures MPa.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from fem_reference.interface import ACTIVATION, INSIDE_SHARE, REST_SHARE, barrier
from fem_reference.problem import NewtonError
from fem_reference.rod_axis import DEGREE, SplineBasis

# Penalty of the bond [MPa/mm]: 500 times the stiffness of the inner wall, 0.3 MPa over 1.5 mm.
BOND_STIFFNESS = 100.0
# Control points that a node may feel: those of its station's span at rest, and of the spans beside it.
WINDOW = DEGREE + 3
_CLOSEST_STEPS = 30


class AxisContact:
    """Nodes of the cavity's wall and the control points of the rod's curve.

    Parameters
    ----------
    nodes : indices of the cavity's nodes; areas : reference area of each [mm²].
    stations : reference z of each [mm].
    bonded : which of them are bonded.
    radius : of the rod [mm].
    basis : of the curve.
    first_control : index of the first control point among all positions.
    """

    def __init__(
        self,
        nodes: Int[np.ndarray, " contacts"],
        areas: Float[np.ndarray, " contacts"],
        stations: Float[np.ndarray, " contacts"],
        bonded: Bool[np.ndarray, " contacts"],
        radius: float,
        basis: SplineBasis,
        first_control: int,
    ) -> None:
        self.nodes = nodes
        self.bonded = bonded
        self.stations = stations
        self._areas = areas
        self._radius = radius
        self._basis = basis
        low = np.clip(basis.first_control(stations) - 1, 0, basis.count - WINDOW)
        self._window = low[:, None] + np.arange(WINDOW)
        self._controls = first_control + self._window
        #: A node and its window of control points.
        self.connectivity = np.concatenate([nodes[:, None], self._controls], axis=1)
        self._rest_value, self._rest_slope = (self._local(stations, order) for order in (0, 1))

    def _local(self, stations: Float[np.ndarray, " n"], order: int) -> Float[np.ndarray, "n window"]:
        return np.take_along_axis(self._basis.values(stations, order), self._window, axis=1)

    def gap(self, positions: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " contacts"]:
        """Distance from the rod's surface to each node [mm]; slightly negative under contact pressure."""
        _, offset, *_ = self._closest(positions)
        return np.linalg.norm(offset, axis=1) - self._radius

    def admissible(self, positions: Float[np.ndarray, "points 3"]) -> bool:
        """Whether every free node is on its own side of the axis, with some way to go."""
        return bool((self.gap(positions)[~self.bonded] > -INSIDE_SHARE * self._radius).all())

    def pressure(self, positions: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " contacts"]:
        """Pressure on the rod at each node, per reference area [MPa]; in tension of a bond, negative."""
        _, slope, _ = self._normal_law(self.gap(positions))
        return -slope

    def energy(self, positions: Float[np.ndarray, "points 3"]) -> float:
        """Energy of contact and bond [N mm]."""
        slip, *_ = self._slip(positions)
        normal, *_ = self._normal_law(self.gap(positions))
        bond = np.where(self.bonded, 0.5 * BOND_STIFFNESS * slip**2, 0.0)
        return float((self._areas * (normal + bond)).sum())

    def force(self, positions: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "contacts dofs"]:
        """Forces on each node and its window, those of `response`."""
        normal, distance = self._normal(positions)
        _, first, _ = self._normal_law(distance - self._radius)
        force = (self._areas * first)[:, None] * normal
        if self.bonded.any():
            slip, slip_gradient, _ = self._slip(positions)
            force += (np.where(self.bonded, BOND_STIFFNESS, 0.0) * self._areas * slip)[
                :, None
            ] * slip_gradient
        return force

    def _normal(self, positions: Float[np.ndarray, "points 3"]) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of each gap by the node and its window, and the node's distance from the curve."""
        s, offset, *_ = self._closest(positions)
        weight = self._weight(s)
        distance = np.linalg.norm(offset, axis=1)
        direction = offset / distance[:, None]
        return (weight[:, :, None] * direction[:, None, :]).reshape(len(s), -1), distance

    def response(
        self, positions: Float[np.ndarray, "points 3"]
    ) -> tuple[Float[np.ndarray, "contacts dofs"], Float[np.ndarray, "contacts dofs dofs"]]:
        """Forces and tangents on each node and its window; the closest point's motion is condensed."""
        s, offset, tangent, bend = self._closest(positions)
        slope, weight = self._local(s, 1), self._weight(s)
        # D = ½|x − c(s)|² and its derivatives in y = (x, P); s is stationary.
        gradient = weight[:, :, None] * offset[:, None, :]
        mixed = -weight[:, :, None] * tangent[:, None, :]
        mixed[:, 1:] -= slope[:, :, None] * offset[:, None, :]
        gradient, mixed = (a.reshape(len(s), -1) for a in (gradient, mixed))
        hessian = _isotropic(weight[:, :, None] * weight[:, None, :])
        hessian -= mixed[:, :, None] * mixed[:, None, :] / bend[:, None, None]

        distance = np.linalg.norm(offset, axis=1)
        gap_gradient = gradient / distance[:, None]
        gap_hessian = (hessian - gap_gradient[:, :, None] * gap_gradient[:, None, :]) / distance[
            :, None, None
        ]
        _, first, second = self._normal_law(distance - self._radius)
        force = (self._areas * first)[:, None] * gap_gradient
        stiffness = self._areas[:, None, None] * (
            first[:, None, None] * gap_hessian
            + second[:, None, None] * gap_gradient[:, :, None] * gap_gradient[:, None, :]
        )
        if self.bonded.any():
            slip, slip_gradient, slip_hessian = self._slip(positions)
            penalty = np.where(self.bonded, BOND_STIFFNESS, 0.0) * self._areas
            force += (penalty * slip)[:, None] * slip_gradient
            stiffness += penalty[:, None, None] * (
                slip_gradient[:, :, None] * slip_gradient[:, None, :] + slip[:, None, None] * slip_hessian
            )
        return force, stiffness

    def concave_part(
        self, positions: Float[np.ndarray, "points 3"]
    ) -> Float[np.ndarray, "contacts dofs dofs"]:
        """What of the free nodes' tangents comes with the rod's roundness: pressed, a node slides off it.

        That is around the rod alone, relative to the closest point of its curve. Along it, contact is left
        as it is: there its forces turn with the rod, which carries loads of the whole body.
        """
        s, offset, tangent, _ = self._closest(positions)
        distance = np.linalg.norm(offset, axis=1)
        around = np.cross(tangent, offset)
        around /= np.linalg.norm(around, axis=1)[:, None]
        _, first, _ = self._normal_law(distance - self._radius)
        move = (self._weight(s)[:, :, None] * around[:, None, :]).reshape(len(s), -1)
        concave = (self._areas * first / distance)[:, None, None] * move[:, :, None] * move[:, None, :]
        concave[self.bonded] = 0.0
        return concave

    def _weight(self, s: Float[np.ndarray, " contacts"]) -> Float[np.ndarray, "contacts points"]:
        """What each node and its window add to the offset from the curve at stations that are held."""
        value = self._local(s, 0) + self._beyond(s)[:, None] * self._local(s, 1)
        return np.concatenate([np.ones((len(s), 1)), -value], axis=1)

    def _normal_law(
        self, gap: Float[np.ndarray, " contacts"]
    ) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Energy per area and its two derivatives by the gap: barrier, or bond."""
        free = barrier(gap + REST_SHARE * ACTIVATION)
        bond = (0.5 * BOND_STIFFNESS * gap**2, BOND_STIFFNESS * gap, np.full_like(gap, BOND_STIFFNESS))
        energy, first, second = (np.where(self.bonded, b, f) for b, f in zip(bond, free, strict=True))
        return energy, first, second

    def _slip(
        self, positions: Float[np.ndarray, "points 3"]
    ) -> tuple[Float[np.ndarray, " contacts"], Float[np.ndarray, "contacts dofs"], np.ndarray]:
        """Slip (x − c(s₀))·c'(s₀) and its two derivatives in y = (x, P)."""
        controls = positions[self._controls]
        offset = positions[self.nodes] - np.einsum("na,nai->ni", self._rest_value, controls)
        tangent = np.einsum("na,nai->ni", self._rest_slope, controls)
        weight = np.concatenate([np.ones((len(offset), 1)), -self._rest_value], axis=1)
        turn = np.concatenate([np.zeros((len(offset), 1)), self._rest_slope], axis=1)
        gradient = weight[:, :, None] * tangent[:, None, :] + turn[:, :, None] * offset[:, None, :]
        both = weight[:, :, None] * turn[:, None, :]
        return (
            np.einsum("ni,ni->n", offset, tangent),
            gradient.reshape(len(offset), -1),
            _isotropic(both + np.swapaxes(both, 1, 2)),
        )

    def _beyond(self, s: Float[np.ndarray, " contacts"]) -> Float[np.ndarray, " contacts"]:
        """How far a station lies beyond an end, where the rod goes on straight."""
        return s - np.clip(s, 0.0, self._basis.length)

    def _closest(
        self, positions: Float[np.ndarray, "points 3"]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Station of the closest point of the curve, offset from it, tangent there, and ∂²D/∂s²."""
        x, controls = positions[self.nodes], positions[self._controls]
        s = self.stations.copy()
        low = self._window[:, 0] - np.where(self._window[:, 0] == 0, DEGREE, 0)
        high = self._window[:, 0] + WINDOW - DEGREE
        high = np.where(high == self._basis.spans, high + DEGREE, high)
        for _ in range(_CLOSEST_STEPS):
            c, tangent, curve = (
                np.einsum("na,nai->ni", self._local(s, order), controls) for order in range(3)
            )
            beyond = self._beyond(s)[:, None]
            offset = x - c - beyond * tangent
            residual = np.einsum("ni,ni->n", offset, tangent)
            curve = np.where(beyond != 0.0, 0.0, curve)
            bend = np.einsum("ni,ni->n", tangent, tangent) - np.einsum("ni,ni->n", offset, curve)
            if np.abs(residual).max() < 1e-13:
                break
            s = s + residual / bend
            if ((s < low * self._basis.span) | (s > high * self._basis.span)).any():
                raise NewtonError("the cavity's wall slips along the rod by more than a span of its curve")
        return s, offset, tangent, bend


def _isotropic(coefficient: Float[np.ndarray, "n a a"]) -> Float[np.ndarray, "n dofs dofs"]:
    """Blocks coefficient_ab δ_ij as one matrix over (a, i), (b, j)."""
    n, a, _ = coefficient.shape
    return (coefficient[:, :, None, :, None] * np.eye(3)[:, None, :]).reshape(n, 3 * a, 3 * a)
