"""Central rod of the actuator: an inextensible cubic B-spline curve with bending stiffness.

The unknowns of the curve c(s), 0 ≤ s ≤ L, are its control points P_i; s is the arc length at rest. Its energy

    Σ_spans EA/2 h ē² + EI/2 ∫ |c''|² ds + weight,   ē = (1/h) ∫_span (|c'| − 1) ds,

has one stretch ē per span, which avoids locking. The tension EA ē is a separate unknown while Newton's method
iterates (see `newton`). Torsion has no energy: the cavity rotates on the rod without friction. Lengths mm,
forces N.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import BSpline, PPoly

DEGREE = 3
# Axial stiffness EA [N], for the paper's inextensible beam: a tension of 3 N, as of 70 kPa in all chambers,
# stretches 66 mm by 2 µm.
AXIAL_STIFFNESS = 1e5
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)


class SplineBasis:
    """Cubic B-splines with uniform knots on [0, length].

    Parameters
    ----------
    length : length L of the curve [mm].
    spans : number of polynomial pieces.
    """

    def __init__(self, length: float, spans: int) -> None:
        self.length = length
        self.spans = spans
        self.span = length / spans
        inner = np.linspace(0.0, length, spans + 1)
        knots = np.concatenate([np.zeros(DEGREE), inner, np.full(DEGREE, length)])
        self.count = spans + DEGREE
        self._splines = [BSpline(knots, np.eye(self.count), DEGREE)]
        self._splines += [self._splines[0].derivative(order) for order in (1, 2)]
        self._pieces = [self._local_pieces(spline) for spline in self._splines]
        #: Greville stations: control points there reproduce the straight rod, c(s) = s e3.
        self.greville = np.array([knots[i + 1 : i + DEGREE + 1].mean() for i in range(self.count)])

    def _local_pieces(self, spline: BSpline) -> Float[np.ndarray, "powers spans local"]:
        """Return the polynomials of every span's basis functions from its start, highest power first."""
        # Repeated knots at the ends have pieces of zero length.
        each = (BSpline(spline.t, one, spline.k) for one in spline.c.T)
        pieces = np.stack([PPoly.from_spline(one).c for one in each], axis=2)
        pieces = pieces[:, spline.k : spline.k + self.spans]
        own = np.arange(self.spans)[:, None] + np.arange(DEGREE + 1)
        return np.take_along_axis(pieces, own[None], axis=2)

    def first_control(self, stations: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Return the first control point that acts at each station."""
        return np.clip((stations / self.span).astype(int), 0, self.spans - 1)

    def values(self, stations: Float[np.ndarray, " n"], order: int = 0) -> Float[np.ndarray, "n controls"]:
        """Return the basis functions, or their first or second derivatives, at each station."""
        return self._splines[order](np.clip(stations, 0.0, self.length))

    def pieces(self, controls: Float[np.ndarray, "controls 3"]) -> Float[np.ndarray, "spans powers 3"]:
        """Return the curve's polynomial on every span from its start, highest power first."""
        own = controls[np.arange(self.spans)[:, None] + np.arange(DEGREE + 1)]
        return np.einsum("psa,sai->spi", self._pieces[0], own)

    def local(
        self, stations: Float[np.ndarray, " n"], first: Int[np.ndarray, " n"], order: int
    ) -> Float[np.ndarray, "n local"]:
        """Return the part of `values` for the control points of one span, from ``first`` on."""
        way = (np.clip(stations, 0.0, self.length) - first * self.span)[:, None]
        highest, *lower = self._pieces[order]
        value = highest[first]
        for coefficients in lower:
            value = value * way + coefficients[first]
        return value


class CoreSpline:
    """Stretch, bending and weight of the rod.

    Parameters
    ----------
    basis : spline basis of the curve.
    bending_stiffness : EI [N mm²].
    mass_per_length : mass per length [tonne/mm], which times mm/s² gives newtons per mm.
    """

    def __init__(self, basis: SplineBasis, bending_stiffness: float, mass_per_length: float) -> None:
        self.basis = basis
        self.axial_stiffness = AXIAL_STIFFNESS
        stations = (np.arange(basis.spans)[:, None] + 0.5 * (1.0 + _POINTS)) * basis.span
        weights = np.tile(0.5 * basis.span * _WEIGHTS, basis.spans)
        slope = basis.values(stations.ravel(), 1)
        #: Control points of every span.
        self.connectivity = np.arange(basis.spans)[:, None] + np.arange(DEGREE + 1)
        local = slope.reshape(basis.spans, len(_POINTS), -1)
        self._slope = np.take_along_axis(local, self.connectivity[:, None, :], axis=2)
        self._weights = 0.5 * basis.span * _WEIGHTS
        curve = basis.values(stations.ravel(), 2)
        #: EI ∫ N_i'' N_j'' ds, the same for the three components.
        self.bending = bending_stiffness * (curve.T * weights) @ curve
        self.mass = mass_per_length * (weights @ basis.values(stations.ravel()))

    def rest(self) -> Float[np.ndarray, "controls 3"]:
        """Return the control points of the straight rod along z."""
        points = np.zeros((self.basis.count, 3))
        points[:, 2] = self.basis.greville
        return points

    def _tangents(self, controls: Float[np.ndarray, "controls 3"]) -> Float[np.ndarray, "spans points 3"]:
        return np.einsum("ega,eai->egi", self._slope, controls[self.connectivity])

    def extension(self, controls: Float[np.ndarray, "controls 3"]) -> Float[np.ndarray, " spans"]:
        """Return the elongation of every span [mm]."""
        return (np.linalg.norm(self._tangents(controls), axis=2) - 1.0) @ self._weights

    def tension(self, controls: Float[np.ndarray, "controls 3"]) -> Float[np.ndarray, " spans"]:
        """Return the constitutive tension of every span [N]."""
        return self.axial_stiffness / self.basis.span * self.extension(controls)

    def energy(self, controls: Float[np.ndarray, "controls 3"]) -> float:
        """Return the stretch and bending energy [N mm]."""
        stretch = self.axial_stiffness / self.basis.span / 2.0 * float((self.extension(controls) ** 2).sum())
        return stretch + 0.5 * float(np.einsum("ai,ab,bi->", controls, self.bending, controls))

    def force(self, controls: Float[np.ndarray, "controls 3"]) -> Float[np.ndarray, "spans 12"]:
        """Return only the forces of `response`."""
        return self.tension(controls)[:, None] * self._elongation_gradient(controls)

    def _elongation_gradient(
        self, controls: Float[np.ndarray, "controls 3"]
    ) -> Float[np.ndarray, "spans 12"]:
        tangent = self._tangents(controls)
        direction = tangent / np.linalg.norm(tangent, axis=2)[..., None]
        weighted = self._weights[:, None] * self._slope
        return np.einsum("ega,egi->eai", weighted, direction).reshape(-1, 12)

    def response(
        self, controls: Float[np.ndarray, "controls 3"], tension: Float[np.ndarray, " spans"]
    ) -> tuple[
        Float[np.ndarray, "spans 12"], Float[np.ndarray, "spans 12 12"], Float[np.ndarray, "spans 12"]
    ]:
        """Return forces and tangents of the stretch, and gradients of the elongation, by span.

        Parameters
        ----------
        controls : current control points [mm].
        tension : tension in the geometric part of the tangent [N].
        """
        tangent = self._tangents(controls)
        norm = np.linalg.norm(tangent, axis=2)
        direction = tangent / norm[..., None]
        weighted = self._weights[:, None] * self._slope
        gradient = self._elongation_gradient(controls)
        stiffness = self.axial_stiffness / self.basis.span
        force = self.force(controls)
        across = (np.eye(3) - direction[..., :, None] * direction[..., None, :]) / norm[..., None, None]
        geometric = np.einsum("ega,egij,egb->eaibj", weighted, across, self._slope).reshape(-1, 12, 12)
        tangents = stiffness * gradient[:, :, None] * gradient[:, None, :]
        return force, tangents + tension[:, None, None] * geometric, gradient
