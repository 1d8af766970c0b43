"""Equilibrium of the period cell: energy, residual and Hessian in the nodes, the strain and p.

Total energy of one period (N, mm, MPa), y = (u, λ) being curvature and stretch per length at rest:

    E(x, y, p) = solid + thread + core contact + wall contact + period·EI/2 (u1² + u2²)/λ
                 + period·k/2 (λ − 1)² − Σ_k p_k V_k.

The silicone slides along the core, which keeps its length. In a whole actuator the core pulls on the closed
ends; they give, and the silicone between them becomes longer. A section takes this for a spring k along the
core. Where the ends give nothing, λ = 1.

A cell may keep its plane of symmetry, y = 0: mirror images share unknowns, and u1 and u3 stay zero.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SparsePattern, scatter
from fem_reference.cell.axial import AxialStiffness
from fem_reference.cell.core_contact import CellCoreContact, CoreContactGroup, CoreContactResponse
from fem_reference.cell.helical_periodicity import HelicalFrame, HelicalMap
from fem_reference.cell.screw_motion import ScrewSeries, screw_series
from fem_reference.cell.state import CellLinearisation, Configuration, Step
from fem_reference.cell.unknowns import GAUGES, CellUnknowns, NodalUnknowns
from fem_reference.elements import (
    Chamber,
    ForceGroup,
    Own,
    SolidElements,
    SolidGroup,
    StiffGroup,
    ThreadGroup,
    ThreadSegments,
    ViscousSolid,
    assemble,
    assemble_forces,
    body_groups,
    local_dofs,
    own_after,
    patch_names,
    pressure_groups,
    total_energy,
)
from fem_reference.geometry import ActuatorGeometry, Core, Thread, Units, Winding
from fem_reference.materials import Material
from fem_reference.mesh import (
    CAVITY,
    CHAMBERS,
    MeshLevel,
    body_mesh,
    even_mesh,
    images_with_winding,
    mirror_pairs,
    symmetrised,
)
from fem_reference.walls import WallContact

#: Components of the strain that bend or twist the body out of the plane of symmetry: u1 and u3.
ACROSS = [0, 2]
#: Name of the force group of the cavity's nodes against the core.
CORE_CONTACT = "core contact"


class CellEquations:
    """Energy of one period of a wound actuator, with its derivatives.

    Parameters
    ----------
    geometry, material, winding, thread : the actuator.
    level : mesh density.
    axial_stiffness : k, of the ends by the body's length [N]; None where they hold the silicone's length.
    core : central rod; by default the paper's.
    symmetric : whether the body keeps its plane of symmetry, y = 0.

    Raises
    ------
    ValueError
        If it should keep the plane, and geometry or winding do not have it.
    """

    def __init__(
        self,
        geometry: ActuatorGeometry,
        material: Material,
        winding: Winding,
        thread: Thread,
        level: MeshLevel,
        axial_stiffness: float | None = None,
        core: Core | None = None,
        symmetric: bool = False,
    ) -> None:
        winding.refuse_overlap(thread)
        #: Whether the body keeps its plane of symmetry.
        self.symmetric = symmetric
        #: Units of all that follows.
        self.units = units = Units.of(geometry, material.shear_modulus)
        length = winding.cell_length(geometry.body_diameter)
        self.mesh = body_mesh(geometry, length, level, min(winding.interval, length), units)
        if symmetric:
            self.mesh = even_mesh(self.mesh)
        # Threads begin where their circumference is clear of the bottom face, and so end in the next period.
        cylinder = (geometry.winding_diameter / 2.0, length, level.around, thread.radius)
        ends = [line[:, 2].max() for line in winding.polylines(*cylinder)]
        overlap = max(ends, default=0.0) + thread.radius - length
        self.helical = HelicalMap(self.mesh, max(overlap, 0.0) * units.metre)
        self.period = self.helical.period
        #: Length of the core's axis on which closest points are sought [mm].
        self.reach = 2.0 * self.period
        #: With the plane of symmetry, one hexahedron of two mirror images, which counts twice.
        self.halves = mirror_pairs(self.mesh.points[self.mesh.elements].mean(axis=1), symmetric)
        self.solid = SolidElements(self.mesh, material, self.halves, units=units)
        self.thread = ThreadSegments(self.helical.continued, winding, thread, *cylinder, units=units)
        at_rest = self.helical.continued.points
        #: Force groups of the nodes that take neither pressures nor the strain.
        self.groups = body_groups(self.solid, self.thread, thread, at_rest, units, is_periodic=True)
        self.chambers = [Chamber(self.mesh, name) for name in CHAMBERS]
        self.walls = WallContact(self.mesh.points, np.concatenate([c.quads for c in self.chambers]))
        radius = geometry.cavity_diameter / 2.0 * units.metre
        self.core_contact = self._contact_with_core(radius)
        self.axial_stiffness = None if axial_stiffness is None else axial_stiffness / units.newton
        modulus = (core or Core()).young_modulus / units.megapascal
        self._axial = AxialStiffness(modulus * np.pi * radius**4 / 4.0, self.axial_stiffness)
        self._rest_positions = self.mesh.points[self.helical.independent]
        self._image = None
        if symmetric:
            self._image = images_with_winding(self._rest_positions, self.thread.points(at_rest))
        #: Unknowns beside the strain.
        self.nodal = NodalUnknowns(self.mesh, self.helical, self._image)
        self.pattern = self._sparse_pattern()

    @property
    def size(self) -> int:
        """Number of unknowns of the nodes, and multipliers of the gauge."""
        return self.nodal.size

    def _sparse_pattern(self) -> SparsePattern:
        groups = {**self.groups, **pressure_groups(self.chambers, np.zeros(3))}
        dofs = local_dofs(groups, lambda nodes: self.nodal.of(nodes)[0])
        points = {name: group.connectivity for name, group in groups.items()}
        points[CORE_CONTACT] = self.core_contact.nodes[:, None]
        dofs[CORE_CONTACT] = self.nodal.of(points[CORE_CONTACT])[0]
        signs = {name: self.nodal.of(nodes)[1] for name, nodes in points.items()}
        return SparsePattern(self.size, dofs, self.nodal.gauge_entries[:2], signs if self.symmetric else None)

    def symmetrised(self, at: Configuration) -> Configuration:
        """A configuration of the cell without the plane of symmetry, made its own mirror image.

        The own forces of the hexahedra that stand for two are kept.
        """
        if self._image is None:
            return at
        whole = len(at.element_pressure) == len(self.halves.standing_for)
        return replace(
            at,
            positions=symmetrised(at.positions, self._image),
            strain=at.strain * [0.0, 1.0, 0.0, 1.0],
            element_pressure=at.element_pressure[self.halves.kept] if whole else at.element_pressure,
        )

    def _contact_with_core(self, radius: float) -> CellCoreContact:
        base = self.helical.base[: len(self.mesh.points)]
        areas = np.bincount(base, weights=self.mesh.nodal_areas(CAVITY), minlength=self.helical.count)
        cavity = self.mesh.nodes(CAVITY)
        nodes = cavity[~self.helical.is_image[cavity]]
        free = self.helical.base[nodes]
        return CellCoreContact(nodes, areas[free], radius, self.mesh.points[nodes, 2])

    def rest(self) -> Configuration:
        """The unloaded cell."""
        return Configuration(
            positions=self._rest_positions.copy(),
            strain=np.array([0.0, 0.0, 0.0, 1.0]),
            element_pressure=np.zeros((len(self.solid), self.solid.modes)),
            segment_tension=np.zeros(len(self.thread)),
            multipliers=np.zeros(GAUGES),
        )

    def all_positions(self, at: Configuration) -> Float[np.ndarray, "nodes 3"]:
        """Positions of every node [mm]."""
        return HelicalFrame(self.helical, at.positions, self.series(at)).positions

    def period_motion(self, at: Configuration) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
        """Rotation, and translation [mm], that take the cell to the next period."""
        motion, *_ = self.series(at).at(self.period)
        return motion[:3, :3], motion[:3, 3]

    def volumes(self, at: Configuration) -> Float[np.ndarray, "3"]:
        """Volume of each chamber in one period [mm³]."""
        positions = self.all_positions(at)
        return np.array([c.volume(positions) for c in self.chambers])

    def energy(self, at: Configuration) -> float:
        """Stored energy of one period, without the work of the pressures [N mm]."""
        series = self.series(at)
        positions = HelicalFrame(self.helical, at.positions, series).positions
        core = CoreContactGroup(self.core_contact.nodes, self.core_contact.response(positions, series))
        stored = total_energy({**self.groups, CORE_CONTACT: core}, self.walls, positions)
        return stored + self.period * self._axial.energy(at.strain).value

    def series(self, at: Configuration) -> ScrewSeries:
        """Rigid motions along the core."""
        return screw_series(at.curvature, self.reach, float(at.strain[3]))

    def _loaded(
        self, pressure: Float[np.ndarray, "3"], core: CoreContactResponse, viscous: ViscousSolid | None
    ) -> dict[str, ForceGroup]:
        """All force groups: with these pressures, this contact with the core, and this resistance."""
        groups = {**self.groups, **pressure_groups(self.chambers, pressure)}
        groups[CORE_CONTACT] = CoreContactGroup(self.core_contact.nodes, core)
        if viscous is not None:
            groups["solid"] = SolidGroup(self.solid, viscous)
        return groups

    def linearise(
        self,
        at: Configuration,
        pressure: Float[np.ndarray, "3"],
        exact: bool = False,
        viscous: ViscousSolid | None = None,
        before: CellLinearisation | None = None,
    ) -> CellLinearisation:
        """Residual and Hessian in nodes, strain and pressures.

        Parameters
        ----------
        at : state.
        pressure : of the chambers [MPa].
        exact : take the own forces of solid and thread from the positions, so that the matrix is the Hessian
            of the energy even away from equilibrium.
        viscous : resistance in a step in time.
        before : where the last step began; see `Equations.linearise`.
        """
        series = self.series(at)
        frame = HelicalFrame(self.helical, at.positions, series)
        x = frame.positions
        core, unknowns = self.core_contact.response(x, series), CellUnknowns(frame, self.nodal.fold)
        own: dict[str, Own] = {} if exact else at.own
        pairs = None if before is None else before.pairs
        groups = self._loaded(pressure, core, viscous)
        found = assemble(groups, self.walls, x, own, self.pattern, unknowns, pairs)
        self.pattern.add_entries(found.data, *self.nodal.gauge_entries)

        columns = unknowns.columns
        np.add.at(columns, self.core_contact.nodes, core.node_strain)
        if found.wall_stiffness is not None:
            columns += (found.wall_stiffness @ frame.strain_motion.reshape(-1, 4)).reshape(-1, 3, 4)
        residual, strain_residual = self._residuals(at, frame, found.force, core)
        free_columns, strain_columns = frame.pull_columns(columns)
        mixed, strain_geometric = frame.geometric(found.force)
        volume_force = np.stack(
            [
                sum(scatter(groups[name].connectivity, found.gradients[name], len(x)) for name in names)
                for names in patch_names(self.chambers)
            ],
            axis=-1,
        )
        volume_free, volume_strain = frame.pull_columns(volume_force)
        axial = self.period * self._axial.energy(at.strain).second
        node_strain = self.nodal.columns(free_columns + mixed)
        strain_strain = strain_columns + strain_geometric + core.strain_stiffness + axial
        strain_pressure = -volume_strain
        if self.symmetric:
            node_strain[:, ACROSS] = 0.0
            strain_strain[ACROSS, :] = strain_strain[:, ACROSS] = 0.0
            # Any stiffness keeps them at zero.
            strain_strain[ACROSS, ACROSS] = self.period
            strain_pressure[ACROSS, :] = 0.0
        return CellLinearisation(
            residual=residual,
            data=found.data,
            walls_touch=found.pairs is not None,
            pairs=found.pairs,
            slack=self.thread.slack(at.segment_tension),
            strain_residual=strain_residual,
            node_strain=node_strain,
            node_pressure=self.nodal.columns(-volume_free),
            strain_strain=strain_strain,
            strain_pressure=strain_pressure,
            volume=np.array([c.volume(x) for c in self.chambers]),
            frame=frame,
            laws=found.laws,
            gradients=found.gradients,
        )

    def update_forces(
        self,
        linear: CellLinearisation,
        at: Configuration,
        pressure: Float[np.ndarray, "3"],
        viscous: ViscousSolid | None = None,
    ) -> CellLinearisation:
        """The residual at ``at``, with the Hessian of ``linear``; see `linearise`."""
        series = self.series(at)
        frame = HelicalFrame(self.helical, at.positions, series)
        core = self.core_contact.response(frame.positions, series)
        groups = self._loaded(pressure, core, viscous)
        force, laws, walls_touch = assemble_forces(groups, self.walls, frame.positions, at.own)
        residual, strain_residual = self._residuals(at, frame, force, core)
        return replace(
            linear,
            residual=residual,
            strain_residual=strain_residual,
            walls_touch=walls_touch,
            frame=frame,
            laws=laws,
        )

    def _residuals(
        self,
        at: Configuration,
        frame: HelicalFrame,
        force: Float[np.ndarray, "nodes 3"],
        core: CoreContactResponse,
    ) -> tuple[Float[np.ndarray, " q"], Float[np.ndarray, "4"]]:
        """Residuals conjugate to nodes and multipliers, and to the strain, from the forces on all nodes."""
        free_force, strain_force = frame.pull_force(force)
        residual = self.nodal.residual(at.positions, free_force, at.multipliers)
        axial = self.period * self._axial.energy(at.strain).first
        strain_residual = strain_force + core.strain_force + axial
        if self.symmetric:
            strain_residual[ACROSS] = 0.0
        return residual, strain_residual

    def advance(
        self, at: Configuration, step: Step, fraction: float, linear: CellLinearisation
    ) -> Configuration:
        """The state after a fraction of a Newton step, with the own forces of solid and thread."""
        stiff: dict[str, StiffGroup] = {"solid": SolidGroup(self.solid), "thread": ThreadGroup(self.thread)}
        move = linear.frame.motion(step.positions, step.strain)
        x = linear.frame.positions
        own = own_after(stiff, at.own, linear.laws, linear.gradients, x, move, fraction)
        return Configuration(
            positions=at.positions + fraction * step.positions,
            strain=at.strain + fraction * step.strain,
            element_pressure=own["solid"],
            segment_tension=own["thread"],
            multipliers=at.multipliers + fraction * step.multipliers,
        )
