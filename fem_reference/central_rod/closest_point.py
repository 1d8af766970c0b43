"""Points of the cavity's wall beside the rod's curve: the closest station to each, its distance and tangents.

A point is carried by nodes, x_p = Σ N_a x_a with shares N that stay; the curve by control points P. Its
distance to the curve is a function of both, y = (x_a, P), with the closest station condensed. Lengths mm.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from fem_reference.central_rod.spline_rod import DEGREE, SplineBasis
from fem_reference.errors import NewtonError

_CLOSEST_STEPS = 30
# Control points of one span.
_OWN = np.arange(DEGREE + 1)


@dataclass(frozen=True)
class BentState:
    """Distances d of points from the curve with all that their second derivatives are made of.

    With weights w, unit vectors i of space, gradients g and what moves the closest station, m, they are
    (w wᵀ ⊗ i iᵀ − m mᵀ/b − g gᵀ)/d.

    Parameters
    ----------
    distance : d [mm].
    weight : w, what carriers and window add to the offset.
    normal : g, derivative of the distance.
    mixed : m, of the slope of ½d² along the curve [mm].
    bend : b, its derivative along the curve.
    """

    distance: Float[np.ndarray, " points"]
    weight: Float[np.ndarray, "points _"]
    normal: Float[np.ndarray, "points dofs"]
    mixed: Float[np.ndarray, "points dofs"]
    bend: Float[np.ndarray, " points"]


class ClosestPoints:
    """Points of the wall and the control points of the curve that each may feel.

    Parameters
    ----------
    carriers : nodes that carry each point; shares : of each carrier.
    stations : z of each point at rest [mm].
    basis : of the curve.
    window : control points of each point: those of its station's span at rest and of the spans beside it.
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
        #: Carriers and window of control points of each point.
        self.connectivity = np.concatenate([carriers, self._controls], axis=1)

    def local(self, stations: Float[np.ndarray, " points"], order: int) -> Float[np.ndarray, "points window"]:
        """Basis functions of the window, or their derivatives."""
        first, local = self._first(stations), np.zeros(self._window.shape)
        own = (first - self._window[:, 0])[:, None] + _OWN
        np.put_along_axis(local, own, self._basis.local(stations, first, order), axis=1)
        return local

    def _first(self, stations: Float[np.ndarray, " points"]) -> Int[np.ndarray, " points"]:
        """First of the control points that act at each station, in the window."""
        return np.clip(self._basis.first_control(stations), self._window[:, 0], self._window[:, -1] - DEGREE)

    def places(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, "points 3"]:
        """Where the points are [mm]."""
        return np.einsum("a,nai->ni", self._shares, positions[self.carriers])

    def on_curve(
        self, positions: Float[np.ndarray, "all 3"], values: Float[np.ndarray, "points window"]
    ) -> Float[np.ndarray, "points 3"]:
        """Points, or derivatives, of the curve from its local basis functions."""
        return np.einsum("na,nai->ni", values, positions[self._controls])

    def weight(self, curve: Float[np.ndarray, "points window"]) -> Float[np.ndarray, "points _"]:
        """What carriers and window add to the offset from a point of the curve with these functions."""
        own = np.broadcast_to(self._shares, self.carriers.shape)
        return np.concatenate([own, -curve], axis=1)

    def distance(self, positions: Float[np.ndarray, "all 3"]) -> Float[np.ndarray, " points"]:
        """From the curve [mm]."""
        _, offset, *_ = self._closest(positions)
        return np.linalg.norm(offset, axis=1)

    def normal(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points dofs"]]:
        """Distance of each point and its derivative by carriers and window."""
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
        """Distance and its two derivatives; the closest point's motion is condensed."""
        bent = self.bent(positions)
        weight, gradient = bent.weight, bent.normal
        hessian = isotropic(weight[:, :, None] * weight[:, None, :])
        hessian -= (bent.mixed / bent.bend[:, None])[:, :, None] * bent.mixed[:, None, :]
        hessian -= gradient[:, :, None] * gradient[:, None, :]
        hessian /= bent.distance[:, None, None]
        return bent.distance, gradient, hessian

    def bent(self, positions: Float[np.ndarray, "all 3"]) -> BentState:
        """See `BentState`; the closest point's motion is condensed."""
        s, offset, tangent, bend = self._closest(positions)
        slope, weight = self.local(s, 1), self._weight_at(s)
        # D = ½|x − c(s)|² and its derivatives in y; s is stationary.
        gradient = weight[:, :, None] * offset[:, None, :]
        mixed = -weight[:, :, None] * tangent[:, None, :]
        mixed[:, -slope.shape[1] :] -= slope[:, :, None] * offset[:, None, :]
        distance = np.linalg.norm(offset, axis=1)
        return BentState(distance, weight, rows(gradient) / distance[:, None], rows(mixed), bend)

    def around(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points dofs"]]:
        """Distance, and how each point moves around the curve relative to its closest point, by y."""
        s, offset, tangent, _ = self._closest(positions)
        around = np.cross(tangent, offset)
        around /= np.linalg.norm(around, axis=1)[:, None]
        move = self._weight_at(s)[:, :, None] * around[:, None, :]
        return np.linalg.norm(offset, axis=1), rows(move)

    def _weight_at(self, s: Float[np.ndarray, " points"]) -> Float[np.ndarray, "points _"]:
        return self.weight(self.local(s, 0) + self._beyond(s)[:, None] * self.local(s, 1))

    def _beyond(self, s: Float[np.ndarray, " points"]) -> Float[np.ndarray, " points"]:
        """How far a station lies beyond an end, where the rod goes on straight."""
        return s - np.clip(s, 0.0, self._basis.length)

    def _closest(
        self, positions: Float[np.ndarray, "all 3"]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Station of the closest point of the curve, offset from it, tangent there, and ∂²D/∂s²."""
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
                raise NewtonError("the cavity's wall slips along the rod, off the spans of its curve nearby")
        return s, offset, tangent, bend


def windows(
    basis: SplineBasis, low: Float[np.ndarray, " n"], high: Float[np.ndarray, " n"]
) -> Int[np.ndarray, "n window"]:
    """Control points of the spans from each ``low`` station to each ``high`` one, and one more either way."""
    first, last = basis.first_control(low) - 1, basis.first_control(high) + 1
    width = min(int((last - first).max(initial=0)) + DEGREE + 1, basis.count)
    return np.clip(first, 0, basis.count - width)[:, None] + np.arange(width)


def rows(vectors: Float[np.ndarray, "n a 3"]) -> Float[np.ndarray, "n dofs"]:
    """Vectors of each point's carriers and window in a row, of no points too."""
    n, a, _ = vectors.shape
    return vectors.reshape(n, 3 * a)


def isotropic(coefficient: Float[np.ndarray, "n a a"]) -> Float[np.ndarray, "n dofs dofs"]:
    """Blocks coefficient_ab δ_ij as one matrix over (a, i), (b, j)."""
    n, a, _ = coefficient.shape
    return (coefficient[:, :, None, :, None] * np.eye(3)[:, None, :]).reshape(n, 3 * a, 3 * a)
