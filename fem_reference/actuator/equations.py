"""Equilibrium of the full actuator: energy, residual and stiffness in nodes and the core's control points.

Total energy (N, mm, MPa), to which a follower load adds a force without one:

    E(x, P, p) = solid + thread + core + cavity on core + walls − Σ_k p_k V_k − loads' work.

Positions of all mesh nodes come first, then the control points P of the core's curve. The base, z = 0, is
clamped: its nodes, the core's end and the core's direction there. The cap's cavity is bonded to the core.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Bool, Float, Int

from fem_reference.actuator.core import CoreGroup, cavity_on_core
from fem_reference.actuator.external_load import ExternalLoad
from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, ActuatorModel, Deformation
from fem_reference.algebra import DofMap, SlabOrdering, SparsePattern
from fem_reference.central_rod import CoreSpline, SplineBasis
from fem_reference.elements import (
    Chamber,
    DisplacementGroup,
    Entries,
    ForceGroup,
    Own,
    SolidElements,
    SolidGroup,
    StiffGroup,
    ThreadGroup,
    ThreadSegments,
    TipFace,
    ViscousSolid,
    assemble,
    assemble_forces,
    body_groups,
    local_dofs,
    own_after,
    pressure_groups,
    total_energy,
)
from fem_reference.geometry import Units
from fem_reference.mesh import (
    BOTTOM,
    CHAMBERS,
    TOP,
    actuator_mesh,
    even_mesh,
    images_with_winding,
    mirror_pairs,
    symmetrised,
)
from fem_reference.walls import WallContact

# Length of a span of the core's curve [mm]: a tenth of the bending radius at 180°.
_SPAN = 2.0
# Thickness of slabs in elimination as a share of the body's diameter. More or fewer cuts make the factors'
# operations more, for all windings and mesh levels alike.
_SLAB = 1.0 / 3.0
# kg/m³ in tonne/mm³; see `Units.acceleration`.
_DENSITY = 1e-12

Linear = TypeVar("Linear", bound=ActuatorLinearisation)


class ActuatorUnknowns:
    """Components of points that are neither clamped nor tied to a mirror image; see `Unknowns`."""

    def __init__(self, dof_map: DofMap) -> None:
        self._dof_map = dof_map

    def blocks(
        self, connectivity: Int[np.ndarray, "elements points"], stiffness: Float[np.ndarray, "elements n n"]
    ) -> Float[np.ndarray, "elements n n"]:
        """The local matrices as they are: the pattern has their unknowns' signs."""
        return stiffness

    def entries(self, matrix: sparse.spmatrix) -> Entries:
        """See `Unknowns.entries`."""
        return self._dof_map.entries(matrix)


class ActuatorEquations:
    """Energy of the actuator on one mesh, with its derivatives.

    Parameters
    ----------
    model : what the actuator is made of.

    Raises
    ------
    ValueError
        If the body should keep its plane of symmetry, and geometry or winding do not have it.
    """

    def __init__(self, model: ActuatorModel) -> None:
        model.winding.refuse_overlap(model.thread)
        geometry = model.geometry
        #: Units of all that follows.
        self.units = units = Units.of(geometry, model.material.shear_modulus)
        self.mesh = actuator_mesh(geometry, model.level, units)
        if model.symmetric:
            self.mesh = even_mesh(self.mesh)
        self.nodes = len(self.mesh.points)
        self.thread = ThreadSegments(
            self.mesh,
            model.winding,
            model.thread,
            geometry.winding_diameter / 2.0,
            geometry.body_length + (geometry.cap_length if model.cap_wound else 0.0),
            model.level.around,
            units=units,
        )
        self.chambers = [Chamber(self.mesh, name) for name in CHAMBERS]
        radius = geometry.cavity_diameter / 2.0 * units.metre
        #: Radius at which chambers begin [mm].
        self.inner_radius = geometry.chamber_inner_radius * units.metre
        self.body_length = geometry.body_length * units.metre
        length = self.body_length + geometry.cap_length * units.metre
        # A node's window of control points needs three spans.
        self.basis = SplineBasis(length, max(3, round(length / _SPAN)))
        density = model.density * _DENSITY
        bending = model.core.young_modulus / units.megapascal * np.pi * radius**4 / 4.0
        self.axis = CoreSpline(self.basis, bending, density * np.pi * radius**2)
        self.rest_positions = np.concatenate([self.mesh.points, self.axis.rest()])
        self._image = None
        if model.symmetric:
            places = self.thread.points(self.rest_positions)
            self._image = images_with_winding(self.rest_positions, places)
        #: With the plane of symmetry, one hexahedron of two mirror images, which counts twice.
        self.halves = mirror_pairs(self.mesh.points[self.mesh.elements].mean(axis=1), model.symmetric)
        self.solid = SolidElements(self.mesh, model.material, self.halves, units)
        self.walls = WallContact(self.rest_positions, np.concatenate([c.quads for c in self.chambers]))
        # Not a ring of nodes alone: silicone has no finite stiffness against a force on a line.
        tip = max(length - 2.0 * radius, self.body_length)
        above = {"cap": self.body_length, "tip": tip, "all": 0.0}[model.bonded] - 1e-6
        self.bond, self.contact, self.sliding = cavity_on_core(
            self.mesh, self.basis, radius, above, model.symmetric
        )
        #: Force groups that take no pressures.
        self.groups = self._groups(model)
        face = self.mesh.nodes(TOP)
        self.tip = TipFace(face, self.mesh.nodal_areas(TOP)[face], self.rest_positions)
        #: Mass that each point stands for [tonne].
        self.mass = np.concatenate([density * self.solid.nodal_volumes, self.axis.mass])
        self._dof_map = self._numbered()
        self.unknowns = ActuatorUnknowns(self._dof_map)
        #: Number of unknowns.
        self.size = self._dof_map.size
        #: See `DofMap`.
        self.fold = self._dof_map.fold
        self.load = ExternalLoad(self.mass, self.tip, self.fold)
        #: Order of elimination for the factors of the stiffness.
        self.elimination = SlabOrdering(
            self._dof_map.points, self.rest_positions[:, 2], _SLAB * geometry.body_diameter * units.metre
        )
        self._bending = self._dof_map.entries(self._bending_stiffness())
        groups = {**self.groups, **pressure_groups(self.chambers, np.zeros(3))}
        signs = {name: self._dof_map.of(group.connectivity)[1] for name, group in groups.items()}
        self.pattern = SparsePattern(
            self.size,
            local_dofs(groups, lambda connectivity: self._dof_map.of(connectivity)[0]),
            self._bending[:2],
            signs if model.symmetric else None,
        )

    def _groups(self, model: ActuatorModel) -> dict[str, ForceGroup]:
        groups = body_groups(self.solid, self.thread, model.thread, self.mesh.points, self.units)
        groups["core"] = CoreGroup(self.axis, self.nodes)
        groups["core bond"] = DisplacementGroup(self.bond)
        groups["core contact"] = DisplacementGroup(self.contact)
        return groups

    def _numbered(self) -> DofMap:
        """Unknowns: components that are neither clamped nor tied to a mirror image."""
        clamped = np.zeros((len(self.rest_positions), 3), dtype=bool)
        clamped[self.mesh.nodes(BOTTOM)] = True
        clamped[self.nodes] = True
        # The second control point gives the curve its direction at the base.
        clamped[self.nodes + 1, :2] = True
        return DofMap.but_for(clamped) if self._image is None else DofMap.mirrored(clamped, self._image)

    @property
    def clamped(self) -> Bool[np.ndarray, "points 3"]:
        """Components of points that have no unknown."""
        return self._dof_map.held

    def _bending_stiffness(self) -> sparse.spmatrix:
        """The core's bending stiffness over the components of all points."""
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
        controls = at.positions[self.nodes :]
        bending = 0.5 * float((controls * (self.axis.bending @ controls)).sum())
        return total_energy(self.groups, self.walls, at.positions) + bending

    def volumes(self, at: Deformation) -> Float[np.ndarray, "3"]:
        """Volume of each chamber [mm³]."""
        return np.array([chamber.volume(at.positions) for chamber in self.chambers])

    def symmetrised(self, vectors: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "points 3"]:
        """Vectors at points made their own mirror images if the body keeps its plane of symmetry.

        Steps move a point and its image alike, so that a difference between them would stay.
        """
        return vectors if self._image is None else symmetrised(vectors, self._image)

    def _loaded(self, target: ActuatorTarget, viscous: ViscousSolid | None) -> dict[str, ForceGroup]:
        """All force groups, with the target's pressures and a viscous resistance."""
        groups = {**self.groups, **pressure_groups(self.chambers, target.pressure)}
        if viscous is not None:
            groups["solid"] = SolidGroup(self.solid, viscous)
        return groups

    def linearise(
        self,
        at: Deformation,
        target: ActuatorTarget,
        exact: bool = False,
        viscous: ViscousSolid | None = None,
        before: ActuatorLinearisation | None = None,
    ) -> ActuatorLinearisation:
        """Residual and stiffness.

        Parameters
        ----------
        at : unknowns.
        target : pressures and loads.
        exact : take the own forces of solid, thread and core from the positions, so that the matrix is the
            Hessian of the energy even away from equilibrium.
        viscous : resistance in a step in time.
        before : where the last step began; see `Equations.linearise`.
        """
        x = at.positions
        own: dict[str, Own] = {} if exact else at.own
        pairs = None if before is None else before.pairs
        groups = self._loaded(target, viscous)
        found = assemble(groups, self.walls, x, own, self.pattern, self.unknowns, pairs)
        self.pattern.add_entries(found.data, *self._bending)
        found.force[self.nodes :] += self.axis.bending @ x[self.nodes :]
        load = self.load.response(x, target)
        return ActuatorLinearisation(
            residual=self.fold @ (found.force - load.force).ravel(),
            data=found.data,
            walls_touch=found.pairs is not None,
            pairs=found.pairs,
            slack=self.thread.slack(at.segment_tension),
            positions=x,
            force=found.force,
            load_columns=load.columns,
            load_rows=load.rows,
            laws=found.laws,
            gradients=found.gradients,
        )

    def update_forces(
        self, linear: Linear, at: Deformation, target: ActuatorTarget, viscous: ViscousSolid | None = None
    ) -> Linear:
        """The residual at ``at``, with the stiffness of ``linear``; see `linearise`."""
        x = at.positions
        force, laws, walls_touch = assemble_forces(self._loaded(target, viscous), self.walls, x, at.own)
        force[self.nodes :] += self.axis.bending @ x[self.nodes :]
        return replace(
            linear,
            residual=self.fold @ (force - self.load.response(x, target).force).ravel(),
            walls_touch=walls_touch,
            positions=x,
            force=force,
            laws=laws,
        )

    def reaction(
        self, linear: ActuatorLinearisation, target: ActuatorTarget
    ) -> Float[np.ndarray, "points 3"]:
        """Force of the clamp on every point [N]; zero at points that are not clamped."""
        load = self.load.response(linear.positions, target).force
        return np.where(self.clamped, self.symmetrised(linear.force - load), 0.0)

    def advance(
        self,
        at: Deformation,
        step: Float[np.ndarray, "points 3"],
        fraction: float,
        linear: ActuatorLinearisation,
    ) -> Deformation:
        """The deformation after a fraction of a Newton step, own forces of the stiff groups included."""
        stiff: dict[str, StiffGroup] = {
            "solid": SolidGroup(self.solid),
            "thread": ThreadGroup(self.thread),
            "core": CoreGroup(self.axis, self.nodes),
        }
        own = own_after(stiff, at.own, linear.laws, linear.gradients, linear.positions, step, fraction)
        return Deformation(at.positions + fraction * step, own["solid"], own["thread"], own["core"])
