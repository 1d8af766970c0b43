"""Parts of the full actuator on one mesh: silicone, thread, chambers, rod and contact; and its unknowns.

Positions of all mesh nodes come first, then the control points P of the rod's curve. The base, z = 0, is
clamped: its nodes, the rod's end and the rod's direction there. The cap's cavity is bonded to the rod.
Lengths mm, forces N, stresses MPa.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Bool, Float, Int

from fem_reference.actuator.model import ActuatorModel, Deformation
from fem_reference.algebra import DofMap, SlabOrdering, SparsePattern
from fem_reference.cell import THREAD
from fem_reference.central_rod import ROD_YOUNG_MODULUS, CoreBond, CoreContact, CoreSpline, SplineBasis
from fem_reference.elements import Chamber, SolidElements, ThreadBending, ThreadSegments, TipFace
from fem_reference.mesh import (
    BOTTOM,
    CAVITY,
    CHAMBERS,
    MILLIMETRE,
    TOP,
    BodyMesh,
    MirrorPairs,
    actuator_mesh,
    mirror_images,
    mirror_pairs,
    symmetrised,
)
from fem_reference.walls import WallContact

# Length of a span of the rod's curve [mm]: a tenth of the bending radius at 180°.
_SPAN = 2.0
# Thickness of slabs in elimination as a share of the body's diameter: with more or fewer cuts the factors'
# operations are more, of all windings and levels alike.
_SLAB = 1.0 / 3.0
# kg/m³ in tonne/mm³, so that an acceleration in mm/s² gives newtons.
_DENSITY = 1e-12


class ActuatorParts:
    """Everything that the actuator is made of, on one mesh.

    Parameters
    ----------
    model : see there.

    Raises
    ------
    ValueError
        Where the plane of symmetry is to be kept and geometry or winding do not have it.
    """

    def __init__(self, model: ActuatorModel) -> None:
        model.winding.refuse_overlap(model.thread)
        geometry = model.geometry
        self.mesh = actuator_mesh(geometry, model.level)
        if model.symmetric:
            self.mesh = _even(self.mesh)
        self.nodes = len(self.mesh.points)
        self.thread = ThreadSegments(
            self.mesh,
            model.winding,
            model.thread,
            geometry.winding_diameter / 2.0,
            geometry.body_length + (geometry.cap_length if model.cap_wound else 0.0),
            model.level.around,
        )
        #: What resists the thread's bending, if anything.
        self.joints: list[ThreadBending] = []
        if model.thread.bends:
            stiffness = 1e6 * model.thread.bending_stiffness
            self.joints = [ThreadBending(self.thread, self.mesh.points, stiffness)]
        self.chambers = [Chamber(self.mesh, name) for name in CHAMBERS]
        radius = geometry.cavity_diameter / 2.0 * MILLIMETRE
        #: Where chambers begin [mm].
        self.inner_radius = geometry.chamber_inner_radius * MILLIMETRE
        self.body_length = geometry.body_length * MILLIMETRE
        length = self.body_length + geometry.cap_length * MILLIMETRE
        # A node's window of control points wants three spans.
        self.basis = SplineBasis(length, max(3, round(length / _SPAN)))
        density = model.density * _DENSITY
        self.axis = CoreSpline(
            self.basis, ROD_YOUNG_MODULUS * np.pi * radius**4 / 4.0, density * np.pi * radius**2
        )
        self.rest_positions = np.concatenate([self.mesh.points, self.axis.rest()])
        self._image = self._images() if model.symmetric else None
        #: Where the plane is kept, one hexahedron of two that are images, which counts twice.
        self.halves = self._halves(self.mesh.elements)
        self.solid = SolidElements(self.mesh, model.material, self.halves)
        self.walls = WallContact(self.rest_positions, np.concatenate([c.quads for c in self.chambers]))
        #: Nodes of the cavity that may slide on the rod come with its bond and contact.
        self.bond, self.contact, self.sliding = self._axis_contact(radius, length, model.bonded)
        face = self.mesh.nodes(TOP)
        self.tip = TipFace(face, self.mesh.nodal_areas(TOP)[face], self.rest_positions)
        #: Mass that each point stands for [tonne].
        self.mass = np.concatenate([density * self.solid.nodal_volumes, self.axis.mass])
        self._unknowns = self._numbered()
        #: Number of unknowns.
        self.size = self._unknowns.size
        #: See `DofMap`.
        self.fold = self._unknowns.fold
        #: For factors of the stiffness.
        self.elimination = SlabOrdering(
            self._unknowns.points, self.rest_positions[:, 2], _SLAB * geometry.body_diameter * MILLIMETRE
        )
        self._bending = self._unknowns.entries(self._bending_stiffness())
        numbered = [self._unknowns.of(c) for c in self._connectivities()]
        groups, signs = [dofs for dofs, _ in numbered], [sign for _, sign in numbered]
        paddings = [self.thread.padding, *(joints.padding for joints in self.joints)]
        for number, padding in enumerate(paddings, start=THREAD):
            groups[number] = np.where(padding.repeat(3, axis=1), -1, groups[number])
        self.pattern = SparsePattern(self.size, groups, self._bending[:2], signs if model.symmetric else None)

    def _axis_contact(
        self, radius: float, length: float, bonded: str
    ) -> tuple[CoreBond, CoreContact, Int[np.ndarray, " sliding"]]:
        """The cavity's wall on the rod: bonded nodes, facets that are not bonded as a whole, their nodes."""
        # Not a ring of nodes alone: silicone has no finite stiffness against a force on a line.
        tip = max(length - 2.0 * radius, self.body_length)
        above = {"cap": self.body_length, "tip": tip, "all": 0.0}[bonded] - 1e-6
        height = self.mesh.points[:, 2]
        nodes = self.mesh.nodes(CAVITY)
        nodes = nodes[height[nodes] > above]
        areas = self.mesh.nodal_areas(CAVITY)[nodes]
        bond = CoreBond(nodes, areas, height[nodes], radius, self.basis, self.nodes)
        facets = self.mesh.facets[CAVITY]
        free = (height[facets] < above).any(axis=1)
        values, areas = self.mesh.gauss_points(CAVITY)
        facets, areas = facets[free], areas[free]
        halves = self._halves(facets)
        areas = halves.counts[:, None] * areas[halves.kept]
        contact = CoreContact(facets[halves.kept], values, areas, self.mesh.points, self.basis, self.nodes)
        return bond, contact, np.unique(facets)

    def _images(self) -> Int[np.ndarray, " points"] | None:
        """Every point's image, where the winding has images too."""
        if mirror_images(self.thread.points(self.rest_positions)) is None:
            raise ValueError(
                "symmetric: got a winding without it, expected its own mirror image in the plane y = 0"
            )
        return mirror_images(self.rest_positions)

    def _halves(self, blocks: Int[np.ndarray, "blocks nodes"]) -> MirrorPairs:
        return mirror_pairs(self.mesh.points[blocks].mean(axis=1), self._image is not None)

    def _numbered(self) -> DofMap:
        """What is neither clamped nor tied to its mirror image."""
        clamped = np.zeros((len(self.rest_positions), 3), dtype=bool)
        clamped[self.mesh.nodes(BOTTOM)] = True
        clamped[self.nodes] = True
        # The second control point gives the curve its direction at the base.
        clamped[self.nodes + 1, :2] = True
        return DofMap.but_for(clamped) if self._image is None else DofMap.mirrored(clamped, self._image)

    @property
    def clamped(self) -> Bool[np.ndarray, "points 3"]:
        """Which components of which points are held."""
        return self._unknowns.held

    def _connectivities(self) -> list[np.ndarray]:
        return [
            self.solid.connectivity,
            self.thread.connectivity,
            *(joints.connectivity for joints in self.joints),
            *(patch.connectivity for c in self.chambers for patch in c.patches),
            self.nodes + self.axis.connectivity,
            self.bond.connectivity,
            self.contact.connectivity,
        ]

    def _bending_stiffness(self) -> sparse.spmatrix:
        """The rod's bending stiffness over the components of all points."""
        points = sparse.block_diag([sparse.csr_matrix((self.nodes, self.nodes)), self.axis.bending])
        return sparse.kron(points, np.eye(3))

    def rest(self) -> Deformation:
        """The unloaded actuator."""
        return Deformation(
            positions=self.rest_positions.copy(),
            element_pressure=np.zeros((len(self.solid), self.solid.modes)),
            segment_tension=np.zeros(len(self.thread)),
            axis_tension=np.zeros(self.basis.spans),
        )

    def strain_energy(self, at: Deformation) -> float:
        """Energy of all parts, without pressures and loads [N mm]."""
        x = at.positions
        return (
            self.solid.energy(x)
            + self.thread.energy(x)
            + sum(joints.energy(x) for joints in self.joints)
            + self.axis.energy(x[self.nodes :])
            + self.bond.energy(x)
            + self.contact.energy(x)
            + self.walls.energy(x)
        )

    def volumes(self, at: Deformation) -> Float[np.ndarray, "3"]:
        """Volume of each chamber [mm³]."""
        return np.array([chamber.volume(at.positions) for chamber in self.chambers])

    def symmetrised(self, vectors: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Vectors at points made their own mirror images where the plane is kept; else as they are.

        Steps move a point and its image alike, so that what is not alike would stay so.
        """
        return vectors if self._image is None else symmetrised(vectors, self._image)


def _even(mesh: BodyMesh) -> BodyMesh:
    """The mesh as its own mirror image to round-off: half of it then stands for all."""
    image = mirror_images(mesh.points)
    if image is None:
        raise ValueError(
            "symmetric: got a geometry without it, expected its own mirror image in the plane y = 0"
        )
    return replace(mesh, points=symmetrised(mesh.points, image))
