"""The core in the actuator: its stretch as a force group, and the cavity's wall on it (N, mm, MPa)."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from fem_reference.central_rod import CoreBond, CoreContact, CoreSpline, SplineBasis
from fem_reference.elements import Forces, Own, Points, Response, lengthening
from fem_reference.mesh import CAVITY, BodyMesh, mirror_pairs


class CoreGroup:
    """Spans of the core with their tensions as own forces.

    Energy and forces are those of the stretch. The bending stiffness is the same at all positions; the
    actuator's equations add it.

    Parameters
    ----------
    spline : the core's curve.
    first_control : index of its first control point among all points.
    """

    padding = None

    def __init__(self, spline: CoreSpline, first_control: int) -> None:
        self.connectivity = first_control + spline.connectivity
        self._spline, self._first = spline, first_control

    def energy(self, positions: Points) -> float:
        """Energy of the stretch [N mm]."""
        controls = positions[self._first :]
        return 0.5 * float(self._spline.tension(controls) @ self._spline.extension(controls))

    def force(self, positions: Points, own: Own | None) -> Forces:
        """See `ForceGroup.force`."""
        return Forces(self._spline.force(positions[self._first :]))

    def response(self, positions: Points, own: Own | None) -> Response:
        """See `ForceGroup.response`."""
        controls = positions[self._first :]
        tension = self._spline.tension(controls) if own is None else own
        force, stiffness, gradient = self._spline.response(controls, tension)
        return Response(force, stiffness, gradient=gradient)

    def own_after(self, positions: Points, own: Own, law: Own, gradient: Own, move: Points) -> Own:
        """See `StiffGroup.own_after`."""
        spline = self._spline
        stiffness = spline.axial_stiffness / spline.basis.span
        extension = lengthening(gradient, move[self.connectivity])
        return spline.tension(positions[self._first :]) + stiffness * extension


class CavityOnCore(NamedTuple):
    """The cavity's wall on the core: bonded nodes, facets that may slide and leave it, and their nodes."""

    bond: CoreBond
    contact: CoreContact
    sliding: Int[np.ndarray, " sliding"]


def cavity_on_core(
    mesh: BodyMesh, basis: SplineBasis, radius: float, bonded_above: float, symmetric: bool
) -> CavityOnCore:
    """Bond nodes above a height [mm]; facets with a node below it are in contact.

    Parameters
    ----------
    mesh : of the body, whose nodes come before the core's control points.
    basis, radius : of the core [mm].
    bonded_above : height [mm].
    symmetric : whether one facet of two mirror images counts for both.
    """
    height = mesh.points[:, 2]
    nodes = mesh.nodes(CAVITY)
    nodes = nodes[height[nodes] > bonded_above]
    areas = mesh.nodal_areas(CAVITY)[nodes]
    bond = CoreBond(nodes, areas, height[nodes], radius, basis, len(mesh.points))
    facets = mesh.facets[CAVITY]
    free = (height[facets] < bonded_above).any(axis=1)
    values, areas = mesh.gauss_points(CAVITY)
    facets, areas = facets[free], areas[free]
    halves = mirror_pairs(mesh.points[facets].mean(axis=1), symmetric)
    areas = halves.counts[:, None] * areas[halves.kept]
    contact = CoreContact(facets[halves.kept], values, areas, mesh.points, basis, len(mesh.points))
    return CavityOnCore(bond, contact, np.unique(facets))
