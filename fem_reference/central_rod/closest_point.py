"""Closest point on the rod's curve to points of the cavity's wall: distance and its derivatives.

A wall point is interpolated from nodes, x_p = Σ N_a x_a with constant weights N, and the curve from control
points P. The distance is a function of both, y = (x_a, P); the closest station s is condensed. Lengths mm.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from fem_reference.central_rod.spline_rod import DEGREE, SplineBasis
from fem_reference.errors import NewtonError

# Newton steps for the closest station at most.
_CLOSEST_STEPS = 30
# Control points of one span, relative to its first.
_OWN = np.arange(DEGREE + 1)


@dataclass(frozen=True)
class BentState:
    """Distances d of points from the curve, with the parts of their second derivatives by y.

    With D = ½d², the second derivative of d is (w wᵀ ⊗ 1 − m mᵀ/b − g gᵀ)/d.

    Parameters
    ----------
    distance : d [mm].
    weight : w, weights of carriers and window in the offset x_p − c(s).
    normal : g = ∂d/∂y.
    mixed : m = ∂²D/∂s∂y [mm].
    bend : b = ∂²D/∂s².
    """

    distance: Float[np.ndarray, " points"]
    weight: Float[np.ndarray, "points _"]
    normal: Float[np.ndarray, "points dofs"]
    mixed: Float[np.ndarray, "points dofs"]
    bend: Float[np.ndarray, " points"]


class ClosestPoints:
    """Points of the wall, each with the control points of the curve near it.

    Parameters
    ----------
    carriers : nodes that interpolate each point.
    shares : weight of each carrier.
    stations : z of each point at rest [mm].
    basis : spline basis of the curve.
    window : control points of each point: those of its span at rest and of the neighbouring spans.
    first_control : index of the first control point among all positions.
    """

    def __init__(
        self,
        carriers: Int[np.ndarray, "points carriers"],
        shares: Float[np.ndarray, " carriers"],
        stations: Float[np.ndarray, " points"],
        basis: SplineBasis,
        window: Int[np.ndarray, "points window"],
        first_control: int,
    ) -> None:
        self.carriers = carriers
        self.stations = stations
        self._shares = shares
        self._basis = basis
        self._window = window
        self._first_control = first_control
        self._controls = first_control + window
        #: Carriers of each point and its window of control points.
        self.connectivity = np.concatenate([carriers, self._controls], axis=1)

    def local(self, stations: Float[np.ndarray, " points"], order: int) -> Float[np.ndarray, "points window"]:
        """Return the basis functions of the window, or their derivatives, at each station."""
        first, local = self._first(stations), np.zeros(self._window.shape)
        own = (first - self._window[:, 0])[:, None] + _OWN
        np.put_along_axis(local, own, self._basis.local(stations, first, order), axis=1)
        return local

    def _first(self, stations: Float[np.ndarray, " points"]) -> Int[np.ndarray, " points"]:
        """Return the first control point that acts at each station, limited to the window."""
        return np.clip(self._basis.first_control(stations), self._window[:, 0], self._window[:, -1] - DEGREE)

    def places(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "points 3"]:
        """Return the positions of the points [mm]."""
        return np.einsum("a,nai->ni", self._shares, positions[self.carriers])

    def on_curve(
        self, positions: Float[np.ndarray, "all 3"], values: Float[np.ndarray, "points window"]
    ) -> Float[np.ndarray, "points 3"]:
        """Return points, or derivatives, of the curve from the basis functions of the window."""
        return np.einsum("na,nai->ni", values, positions[self._controls])

    def weight(self, curve: Float[np.ndarray, "points window"]) -> Float[np.ndarray, "points _"]:
        """Return the weights of carriers and window in the offset from the curve with these functions."""
        own = np.broadcast_to(self._shares, self.carriers.shape)
        return np.concatenate([own, -curve], axis=1)

    def distance(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, " points"]:
        """Return each point's distance from the curve [mm]."""
        _, offset, *_ = self._closest(positions)
        return np.linalg.norm(offset, axis=1)

    def normal(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points dofs"]]:
        """Return each point's distance and its derivative by carriers and window."""
        s, offset, *_ = self._closest(positions)
        distance = np.linalg.norm(offset, axis=1)
        direction = offset / distance[:, None]
        gradient = self._weight_at(s)[:, :, None] * direction[:, None, :]
        return distance, rows(gradient)

    def curvature(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[
        Float[np.ndarray, " points"], Float[np.ndarray, "points dofs"], Float[np.ndarray, "points dofs dofs"]
    ]:
        """Return the distance and its first two derivatives, with the closest station condensed."""
        bent = self.bent(positions)
        weight, gradient = bent.weight, bent.normal
        hessian = isotropic(weight[:, :, None] * weight[:, None, :])
        hessian -= (bent.mixed / bent.bend[:, None])[:, :, None] * bent.mixed[:, None, :]
        hessian -= gradient[:, :, None] * gradient[:, None, :]
        hessian /= bent.distance[:, None, None]
        return bent.distance, gradient, hessian

    def bent(self, positions: Float[np.ndarray, "all 3"]) -> BentState:
        """Return the `BentState`, with the closest station condensed."""
        s, offset, tangent, bend = self._closest(positions)
        slope, weight = self.local(s, 1), self._weight_at(s)
        # Derivatives of D = ½|x − c(s)|² by y; D is stationary in s.
        gradient = weight[:, :, None] * offset[:, None, :]
        mixed = -weight[:, :, None] * tangent[:, None, :]
        mixed[:, -slope.shape[1] :] -= slope[:, :, None] * offset[:, None, :]
        distance = np.linalg.norm(offset, axis=1)
        return BentState(distance, weight, rows(gradient) / distance[:, None], rows(mixed), bend)

    def around(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points dofs"]]:
        """Return the distance, and the derivative by y of each point's motion around the curve."""
        s, offset, tangent, _ = self._closest(positions)
        around = np.cross(tangent, offset)
        around /= np.linalg.norm(around, axis=1)[:, None]
        move = self._weight_at(s)[:, :, None] * around[:, None, :]
        return np.linalg.norm(offset, axis=1), rows(move)

    def _weight_at(self, s: Float[np.ndarray, " points"]) -> Float[np.ndarray, "points _"]:
        return self.weight(self.local(s, 0) + self._beyond(s)[:, None] * self.local(s, 1))

    def _beyond(self, s: Float[np.ndarray, " points"]) -> Float[np.ndarray, " points"]:
        """Return how far each station lies beyond an end [mm], where the rod continues straight."""
        return s - np.clip(s, 0.0, self._basis.length)

    def _closest(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the closest station, the offset from its point, the tangent there, and ∂²D/∂s²."""
        x = self.places(positions)
        s = self.stations.copy()
        first, last = self._window[:, 0], self._window[:, -1] + 1 - DEGREE
        low = np.where(first == 0, -DEGREE, first)
        high = np.where(last == self._basis.spans, last + DEGREE, last)
        pieces = self._basis.pieces(positions[self._first_control :][: self._basis.count])
        for _ in range(_CLOSEST_STEPS):
            start = self._first(s)
            cubic, square, slope, value = pieces[start].transpose(1, 0, 2)
            way = (np.clip(s, 0.0, self._basis.length) - start * self._basis.span)[:, None]
            c = ((cubic * way + square) * way + slope) * way + value
            tangent = (3.0 * cubic * way + 2.0 * square) * way + slope
            curve = 6.0 * cubic * way + 2.0 * square
            beyond = self._beyond(s)[:, None]
            offset = x - c - beyond * tangent
            residual = np.einsum("ni,ni->n", offset, tangent)
            curve = np.where(beyond != 0.0, 0.0, curve)
            bend = np.einsum("ni,ni->n", tangent, tangent) - np.einsum("ni,ni->n", offset, curve)
            if np.abs(residual).max(initial=0.0) < 1e-13:
                break
            s = s + residual / bend
            if ((s < low * self._basis.span) | (s > high * self._basis.span)).any():
                raise NewtonError(
                    "the cavity's wall slides along the rod beyond the neighbouring spans of its curve"
                )
        return s, offset, tangent, bend


def windows(
    basis: SplineBasis, low: Float[np.ndarray, " n"], high: Float[np.ndarray, " n"]
) -> Int[np.ndarray, "n window"]:
    """Return the control points from one span before each ``low`` to one span after each ``high`` station."""
    first, last = basis.first_control(low) - 1, basis.first_control(high) + 1
    width = min(int((last - first).max(initial=0)) + DEGREE + 1, basis.count)
    return np.clip(first, 0, basis.count - width)[:, None] + np.arange(width)


def rows(vectors: Float[np.ndarray, "n a 3"]) -> Float[np.ndarray, "n dofs"]:
    """Flatten (n, a, 3) to (n, 3a); also for n = 0."""
    n, a, _ = vectors.shape
    return vectors.reshape(n, 3 * a)


def isotropic(coefficient: Float[np.ndarray, "n a a"]) -> Float[np.ndarray, "n dofs dofs"]:
    """Return coefficient_ab δ_ij as one matrix over (a, i), (b, j)."""
    n, a, _ = coefficient.shape
    return (coefficient[:, :, None, :, None] * np.eye(3)[:, None, :]).reshape(n, 3 * a, 3 * a)
