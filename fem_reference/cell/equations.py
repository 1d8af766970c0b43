"""Equilibrium of the period cell: energy, residual and Hessian in the nodes, the strain and p.

Total energy of one period (N, mm, MPa), y = (u, λ) being curvature and stretch per length at rest:

    E(x, y, p) = solid + thread + rod contact + wall contact + period·EI/2 (u1² + u2²)/λ
                 + period·k/2 (λ − 1)² − Σ_k p_k V_k.

The silicone slides along the rod, which keeps its length. Over a whole actuator it is as much longer in the
middle as the closed ends give under the rod's pull: seen from a section, a spring k along the rod. Where the
ends give nothing, λ = 1.

Two multipliers hold the gauge: mean axial slip and mean rotation about the rod of the bottom section are
zero.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sparse
from jaxtyping import Float, Int

from fem_reference.algebra import SparsePattern, scatter
from fem_reference.cell.core_contact import CellCoreContact, CoreContactResponse
from fem_reference.cell.helical_periodicity import HelicalFrame, HelicalMap
from fem_reference.cell.screw_motion import ScrewSeries, screw_series
from fem_reference.cell.state import CellLinearisation, Configuration, Step
from fem_reference.central_rod import ROD_YOUNG_MODULUS
from fem_reference.elements import Chamber, Ogden, SolidElements, ThreadBending, ThreadSegments, ViscousSolid
from fem_reference.geometry import ActuatorGeometry, Thread, Winding
from fem_reference.mesh import BOTTOM, CAVITY, CHAMBERS, MILLIMETRE, MeshLevel, body_mesh
from fem_reference.walls import WallContact

# Compliance of the gauge [mm/N]: violates it by less than 1e-9 mm, and gives its pivots a sign.
_GAUGE_COMPLIANCE = 1e-9
#: Number of gauges: mean slip and mean rotation.
GAUGES = 2
#: The silicone's and the threads' places among the groups of local matrices.
SOLID, THREAD = 0, 1


class CellEquations:
    """Everything that one period of a wound actuator is made of.

    Parameters
    ----------
    geometry, material, winding, thread : the actuator.
    level : mesh density.
    axial_stiffness : k, of the ends by the body's length [N]; None where they hold the silicone's length.
    """

    def __init__(
        self,
        geometry: ActuatorGeometry,
        material: Ogden,
        winding: Winding,
        thread: Thread,
        level: MeshLevel,
        axial_stiffness: float | None = None,
    ) -> None:
        winding.refuse_overlap(thread)
        self.mesh = body_mesh(geometry, winding.period, level)
        # Threads begin where their circumference is clear of the bottom face, and so end in the next period.
        cylinder = (geometry.winding_diameter / 2.0, winding.period, level.around, thread.radius)
        ends = [line[:, 2].max() for line in winding.polylines(*cylinder)]
        overlap = max(ends, default=0.0) + thread.radius - winding.period
        self.helical = HelicalMap(self.mesh, max(overlap, 0.0) * MILLIMETRE)
        self.period = self.helical.period
        #: Length of the rod's axis on which closest points are sought [mm].
        self.reach = 2.0 * self.period
        self.solid = SolidElements(self.mesh, material)
        self.thread = ThreadSegments(self.helical.continued, winding, thread, *cylinder)
        #: What resists the thread's bending, if anything.
        self.joints: list[ThreadBending] = []
        if thread.bends:
            at_rest, stiffness = self.helical.continued.points, 1e6 * thread.bending_stiffness
            self.joints = [ThreadBending(self.thread, at_rest, stiffness, goes_on=True)]
        self.chambers = [Chamber(self.mesh, name) for name in CHAMBERS]
        self.walls = WallContact(self.mesh.points, np.concatenate([c.quads for c in self.chambers]))
        radius = geometry.cavity_diameter / 2.0 * MILLIMETRE
        self.rod = self._rod_contact(radius)
        self.rod_stiffness = ROD_YOUNG_MODULUS * np.pi * radius**4 / 4.0
        self.axial_stiffness = axial_stiffness
        self._rest_positions = self.mesh.points[self.helical.independent]
        self._gauge = self._gauge_rows()
        self._gauge_entries = self._gauge_matrix_entries()
        self.size = 3 * self.helical.count + GAUGES
        groups = [self.helical.reduced_dofs(g) for g in self._connectivities()]
        paddings = [self.thread.padding, *(joints.padding for joints in self.joints)]
        for number, padding in enumerate(paddings, start=THREAD):
            groups[number] = np.where(padding.repeat(3, axis=1), -1, groups[number])
        self.pattern = SparsePattern(self.size, groups, self._gauge_entries[:2])

    def _rod_contact(self, radius: float) -> CellCoreContact:
        base = self.helical.base[: len(self.mesh.points)]
        areas = np.bincount(base, weights=self.mesh.nodal_areas(CAVITY), minlength=self.helical.count)
        cavity = self.mesh.nodes(CAVITY)
        nodes = cavity[~self.helical.is_image[cavity]]
        free = self.helical.base[nodes]
        return CellCoreContact(nodes, areas[free], radius, self.mesh.points[nodes, 2])

    def _gauge_rows(self) -> Float[np.ndarray, "2 freedoms"]:
        """Mean axial displacement and mean rotation, times the mean radius, of the bottom section."""
        weight = self.mesh.nodal_areas(BOTTOM)[self.helical.independent]
        weight /= weight.sum()
        x, y, _ = self._rest_positions.T
        arm = np.sqrt(float((weight * (x**2 + y**2)).sum()))
        rows = np.zeros((GAUGES, self.helical.count, 3))
        rows[0, :, 2] = weight
        rows[1, :, 0] = -weight * y / arm
        rows[1, :, 1] = weight * x / arm
        return rows.reshape(GAUGES, -1)

    def _gauge_matrix_entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and values of the gauge in the system's upper triangle."""
        gauge, node = np.nonzero(self._gauge)
        first = self._gauge.shape[1]
        own = first + np.arange(GAUGES)
        return (
            np.concatenate([node, own]),
            np.concatenate([first + gauge, own]),
            np.concatenate([self._gauge[gauge, node], np.full(GAUGES, -_GAUGE_COMPLIANCE)]),
        )

    def _connectivities(self) -> list[np.ndarray]:
        return [
            self.solid.connectivity,
            self.thread.connectivity,
            *(joints.connectivity for joints in self.joints),
            *(patch.connectivity for c in self.chambers for patch in c.patches),
            self.rod.nodes[:, None],
        ]

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
        return (
            self.solid.energy(positions)
            + self.thread.energy(positions)
            + sum(joints.energy(positions) for joints in self.joints)
            + self.rod.response(positions, series).energy
            + self.walls.energy(positions)
            + self.period * self._axial(at.strain)[0]
        )

    def series(self, at: Configuration) -> ScrewSeries:
        """Of the rigid motions along the rod."""
        return screw_series(at.curvature, self.reach, float(at.strain[3]))

    def _axial(
        self, strain: Float[np.ndarray, "4"]
    ) -> tuple[float, Float[np.ndarray, "4"], Float[np.ndarray, "4 4"]]:
        """Energy per length of the rod's bending and of the ends' spring, and its two derivatives."""
        bend, stretch = strain[:2], strain[3]
        square = float(bend @ bend)
        first, second = np.zeros(4), np.zeros((4, 4))
        first[:2] = bend / stretch
        first[3] = -0.5 * square / stretch**2
        second[[0, 1], [0, 1]] = 1.0 / stretch
        second[:2, 3] = second[3, :2] = -bend / stretch**2
        second[3, 3] = square / stretch**3
        energy = 0.5 * self.rod_stiffness * square / stretch
        first *= self.rod_stiffness
        second *= self.rod_stiffness
        if self.axial_stiffness is not None:
            energy += 0.5 * self.axial_stiffness * (stretch - 1.0) ** 2
            first[3] += self.axial_stiffness * (stretch - 1.0)
            second[3, 3] += self.axial_stiffness
        return energy, first, second

    def linearise(
        self,
        at: Configuration,
        pressure: Float[np.ndarray, "3"],
        exact: bool = False,
        viscous: ViscousSolid | None = None,
        before: CellLinearisation | None = None,
    ) -> CellLinearisation:
        """Residual and Hessian.

        Parameters
        ----------
        at : configuration.
        pressure : of the chambers [MPa].
        exact : take the element pressures and tensions from the deformation, so that the matrix is the
            Hessian of the energy even away from equilibrium.
        viscous : resistance in a step in time.
        before : where the last step was taken; see `Problem.linearise`.
        """
        series = self.series(at)
        frame = HelicalFrame(self.helical, at.positions, series)
        x = frame.positions
        solid = self.solid.response(x, None if exact else at.element_pressure)
        if viscous is not None:
            solid[0][:] += viscous.force(x)
            solid[1][:] += viscous.matrices
        thread = self.thread.response(x, None if exact else at.segment_tension)
        rod = self.rod.response(x, series)
        walls = self.walls.iterate(x, None if before is None else before.pairs)
        volume_gradients = [[patch.gradient(x) for patch in chamber.patches] for chamber in self.chambers]
        parts = [solid[:2], thread[:2], *(joints.response(x) for joints in self.joints)]
        for p, chamber, gradients in zip(pressure, self.chambers, volume_gradients, strict=True):
            for patch, gradient in zip(chamber.patches, gradients, strict=True):
                parts.append((-p * gradient, -p * patch.hessian(x)))
        parts.append((rod.node_force, rod.node_stiffness))

        # Forces, and stiffness times ∂x/∂y, over all nodes; stiffness over the independent ones.
        force = np.zeros_like(x)
        columns = np.zeros((len(x), 3, 4))
        np.add.at(columns, self.rod.nodes, rod.node_strain)
        if walls is not None:
            force += walls[0]
            columns += (walls[1] @ frame.strain_motion.reshape(-1, 4)).reshape(-1, 3, 4)
            wall_entries = _upper_entries(frame, walls[1])
            self.pattern.cover(*wall_entries[:2], lambda: _upper_entries(frame, self.walls.neighbours(x))[:2])
        data = np.zeros(len(self.pattern))
        if walls is not None:
            self.pattern.add_entries(data, *wall_entries)
        for group, (nodes, (local_force, local_stiffness)) in enumerate(
            zip(self._connectivities(), parts, strict=True)
        ):
            force += scatter(nodes, local_force, len(x))
            columns += frame.block_columns(nodes, local_stiffness)
            self.pattern.add_group(data, group, frame.rotate_blocks(nodes, local_stiffness))
        self.pattern.add_entries(data, *self._gauge_entries)

        residual, strain_residual = self._residuals(at, frame, force, rod)
        free_columns, strain_columns = frame.pull_columns(columns)
        mixed, strain_geometric = frame.geometric(force)
        volume_force = np.stack(
            [
                sum(scatter(p.connectivity, g, len(x)) for p, g in zip(c.patches, gradients, strict=True))
                for c, gradients in zip(self.chambers, volume_gradients, strict=True)
            ],
            axis=-1,
        )
        volume_free, volume_strain = frame.pull_columns(volume_force)
        axial = self.period * self._axial(at.strain)[2]
        return CellLinearisation(
            residual=residual,
            strain_residual=strain_residual,
            data=data,
            node_strain=_over_gauges((free_columns + mixed).reshape(-1, 4)),
            node_pressure=_over_gauges(-volume_free.reshape(-1, 3)),
            strain_strain=strain_columns + strain_geometric + rod.strain_stiffness + axial,
            strain_pressure=-volume_strain,
            volume=np.array([c.volume(x) for c in self.chambers]),
            walls_touch=walls is not None,
            pairs=None if walls is None else walls[2],
            slack=self.thread.slack(at.segment_tension),
            frame=frame,
            volume_gradient=solid[2],
            constitutive=solid[3],
            length_gradient=thread[2],
        )

    def update_forces(
        self,
        linear: CellLinearisation,
        at: Configuration,
        pressure: Float[np.ndarray, "3"],
        viscous: ViscousSolid | None = None,
    ) -> CellLinearisation:
        """The residual taken anew, with the Hessian of ``linear``; see `linearise`."""
        series = self.series(at)
        frame = HelicalFrame(self.helical, at.positions, series)
        x = frame.positions
        rod, walls = self.rod.response(x, series), self.walls.force(x)
        solid, constitutive = self.solid.force(x)
        parts = [
            solid if viscous is None else solid + viscous.force(x),
            self.thread.force(x, at.segment_tension),
        ]
        parts += [joints.force(x) for joints in self.joints]
        for p, chamber in zip(pressure, self.chambers, strict=True):
            parts += [-p * patch.gradient(x) for patch in chamber.patches]
        parts.append(rod.node_force)
        force = np.zeros_like(x) if walls is None else walls
        for nodes, local in zip(self._connectivities(), parts, strict=True):
            force += scatter(nodes, local, len(x))
        residual, strain_residual = self._residuals(at, frame, force, rod)
        return replace(
            linear,
            residual=residual,
            strain_residual=strain_residual,
            walls_touch=walls is not None,
            frame=frame,
            constitutive=constitutive,
        )

    def _residuals(
        self,
        at: Configuration,
        frame: HelicalFrame,
        force: Float[np.ndarray, "nodes 3"],
        rod: CoreContactResponse,
    ) -> tuple[Float[np.ndarray, " q"], Float[np.ndarray, "4"]]:
        """Residuals conjugate to nodes and multipliers, and to the strain, from the forces on all nodes."""
        free_force, strain_force = frame.pull_force(force)
        slip = self._gauge @ (at.positions - self._rest_positions).ravel()
        residual = np.concatenate(
            [free_force.ravel() + at.multipliers @ self._gauge, slip - _GAUGE_COMPLIANCE * at.multipliers]
        )
        axial = self.period * self._axial(at.strain)[1]
        return residual, strain_force + rod.strain_force + axial

    def convexified_contact(self, linear: CellLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.convexified_contact`."""
        x, data = linear.frame.positions, linear.data.copy()
        concave = self.walls.concave_part(x)
        if concave is not None:
            self.pattern.add_entries(data, *_upper_entries(linear.frame, -concave))
        return data

    def core_curvature_stiffness(self, linear: CellLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.core_curvature_stiffness`."""
        data = np.zeros(len(self.pattern))
        concave = self.rod.response(linear.frame.positions, linear.frame.series).node_concave
        blocks = linear.frame.rotate_blocks(self.rod.nodes[:, None], concave)
        self.pattern.add_group(data, len(self._connectivities()) - 1, blocks)
        return data

    def advance(
        self, at: Configuration, step: Step, fraction: float, linear: CellLinearisation
    ) -> Configuration:
        """Take a fraction of a Newton step, with the condensed pressures and tensions."""
        move = linear.frame.motion(step.positions, step.strain)
        x, thread = linear.frame.positions, self.thread
        stretch = np.einsum(
            "sa,sa->s",
            linear.length_gradient,
            move[thread.connectivity].reshape(linear.length_gradient.shape),
        )
        pressure = self.solid.pressure_after(linear.constitutive, linear.volume_gradient, move)
        tension = thread.tension_after(x, at.segment_tension, stretch)
        return Configuration(
            positions=at.positions + fraction * step.positions,
            strain=at.strain + fraction * step.strain,
            element_pressure=at.element_pressure + fraction * (pressure - at.element_pressure),
            segment_tension=at.segment_tension + fraction * (tension - at.segment_tension),
            multipliers=at.multipliers + fraction * step.multipliers,
        )


def _over_gauges(columns: Float[np.ndarray, "free m"]) -> Float[np.ndarray, "q m"]:
    """The columns with rows of zeros for the multipliers, which neither strain nor pressure enters."""
    return np.concatenate([columns, np.zeros((GAUGES, columns.shape[1]))])


def _upper_entries(
    frame: HelicalFrame, hessian: sparse.csr_matrix
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """A sparse Hessian over all nodes as entries of the upper triangle over the independent ones."""
    transformation = frame.transformation()
    reduced = (transformation.T @ hessian @ transformation).tocoo()
    upper = reduced.row <= reduced.col
    return reduced.row[upper].astype(np.int64), reduced.col[upper].astype(np.int64), reduced.data[upper]
