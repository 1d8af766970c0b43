"""Equilibrium of the period cell: its energy, residual and Hessian in the nodes, the curvature u and the pressures p.

Total energy of one period (N, mm, MPa):

    E(x, u, p) = solid + thread + rod contact + wall contact + period·EI/2 (u1² + u2²) − Σ_k p_k V_k.

Two multipliers hold the gauge: mean axial slip and mean rotation about the rod of the bottom section are zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem
from jaxtyping import Float

from fem_reference.assembly import SparsePattern
from fem_reference.chamber import Chamber
from fem_reference.geometry import ActuatorGeometry
from fem_reference.helical import HelicalFrame, HelicalMap
from fem_reference.material import Ogden
from fem_reference.mesh import BOTTOM, CAVITY, CHAMBERS, MILLIMETRE, MeshLevel, body_mesh
from fem_reference.rod_contact import RodContact
from fem_reference.screw import screw_series
from fem_reference.solid import SolidElements
from fem_reference.thread import ThreadSegments
from fem_reference.wall_contact import WallContact
from fem_reference.winding import Thread, Winding

# Compliance of the gauge [mm/N]: violates it by less than 1e-9 mm, and gives its pivots a sign.
_GAUGE_COMPLIANCE = 1e-9
#: Number of gauges: mean slip and mean rotation.
GAUGES = 2
# Bending stiffness of the rod's solid part, E π r⁴/4 with E = 5 MPa; the paper's embedded beam only fixes its length.
ROD_YOUNG_MODULUS = 5.0


@dataclass(frozen=True)
class Configuration:
    """Unknowns of the cell.

    Parameters
    ----------
    positions : of the independent nodes [mm].
    curvature : u [1/mm].
    element_pressure : π_e [MPa] and segment_tension [N], independent while Newton iterates.
    multipliers : of the gauge [N].
    """

    positions: Float[np.ndarray, "free 3"]
    curvature: Float[np.ndarray, "3"]
    element_pressure: Float[np.ndarray, " elements"]
    segment_tension: Float[np.ndarray, " segments"]
    multipliers: Float[np.ndarray, "2"]

    def extrapolate(self, earlier: Configuration, ratio: float) -> Configuration:
        """Continue the step from ``earlier`` to this one by ``ratio`` of its length."""
        return Configuration(
            *(
                getattr(self, name) + ratio * (getattr(self, name) - getattr(earlier, name))
                for name in self.__dataclass_fields__
            )
        )


@dataclass(frozen=True)
class Step:
    """Newton step; see `Configuration`."""

    positions: Float[np.ndarray, "free 3"]
    curvature: Float[np.ndarray, "3"]
    multipliers: Float[np.ndarray, "2"]


@dataclass(frozen=True)
class Linearisation:
    """Residual and Hessian at a configuration; ``q`` stands for the independent nodes and the multipliers."""

    residual: Float[np.ndarray, " q"]
    curvature_residual: Float[np.ndarray, "3"]
    data: Float[np.ndarray, " nonzeros"]
    node_curvature: Float[np.ndarray, "q 3"]
    node_pressure: Float[np.ndarray, "q 3"]
    curvature_curvature: Float[np.ndarray, "3 3"]
    curvature_pressure: Float[np.ndarray, "3 3"]
    volume: Float[np.ndarray, "3"]
    pattern_grew: bool
    walls_touch: bool
    frame: HelicalFrame
    volume_gradient: Float[np.ndarray, "elements 24"]
    length_gradient: Float[np.ndarray, "segments 48"]


class CellEquations:
    """Everything that one period of a wound actuator is made of.

    Parameters
    ----------
    geometry, material, winding, thread : the actuator.
    level : mesh density.
    """

    def __init__(
        self, geometry: ActuatorGeometry, material: Ogden, winding: Winding, thread: Thread, level: MeshLevel
    ) -> None:
        self.mesh = body_mesh(geometry, winding.period, level)
        self.helical = HelicalMap(self.mesh)
        self.period = self.helical.period
        #: Length of the rod's axis on which closest points are sought [mm].
        self.reach = 2.0 * self.period
        self.solid = SolidElements(self.mesh, material)
        self.thread = ThreadSegments(
            self.mesh, winding, thread, geometry.winding_diameter / 2.0, winding.period, level.around
        )
        self.chambers = [Chamber(self.mesh, name) for name in CHAMBERS]
        self.walls = WallContact(self.mesh.p.T, np.concatenate([c.quads for c in self.chambers]))
        radius = geometry.cavity_diameter / 2.0 * MILLIMETRE
        self.rod = self._rod_contact(radius)
        self.rod_stiffness = ROD_YOUNG_MODULUS * np.pi * radius**4 / 4.0 * np.array([1.0, 1.0, 0.0])
        self._gauge = self._gauge_rows()
        self.size = 3 * self.helical.count + GAUGES
        self.pattern = self._sparse_pattern()

    def _nodal_areas(self, boundary: str) -> Float[np.ndarray, " nodes"]:
        """Share of a boundary's reference area that belongs to each node [mm²]."""
        basis = skfem.FacetBasis(self.mesh, skfem.ElementHex1(), facets=boundary)
        return skfem.LinearForm(lambda v, _: v).assemble(basis)

    def _rod_contact(self, radius: float) -> RodContact:
        areas = np.bincount(
            self.helical.base, weights=self._nodal_areas(CAVITY), minlength=self.helical.count
        )
        cavity = np.unique(self.mesh.facets[:, self.mesh.boundaries[CAVITY]])
        nodes = cavity[~self.helical.is_image[cavity]]
        free = self.helical.base[nodes]
        return RodContact(nodes, areas[free], radius, self.mesh.p[2, nodes])

    def _gauge_rows(self) -> Float[np.ndarray, "2 free 3"]:
        """Mean axial displacement, and mean rotation about the rod times the mean radius, of the bottom section."""
        weight = self._nodal_areas(BOTTOM)[self.helical.independent]
        weight /= weight.sum()
        x, y = self.mesh.p[0, self.helical.independent], self.mesh.p[1, self.helical.independent]
        rows = np.zeros((GAUGES, self.helical.count, 3))
        rows[0, :, 2] = weight
        inertia = float((weight * (x**2 + y**2)).sum())
        rows[1, :, 0] = -weight * y / np.sqrt(inertia)
        rows[1, :, 1] = weight * x / np.sqrt(inertia)
        return rows

    def _sparse_pattern(self) -> SparsePattern:
        map_ = self.helical
        groups = [map_.reduced_dofs(g) for g in self._connectivities()]
        last = 3 * map_.count
        row, column = [], []
        for k in range(GAUGES):
            coupled = np.flatnonzero(self._gauge[k].ravel())
            row.append(coupled)
            column.append(np.full(len(coupled), last + k))
        return SparsePattern(self.size, groups, (np.concatenate(row), np.concatenate(column)))

    def _connectivities(self) -> list[np.ndarray]:
        return [
            self.solid.connectivity,
            self.thread.connectivity,
            *(c.triangles for c in self.chambers),
            self.rod.nodes[:, None],
        ]

    def rest(self) -> Configuration:
        """The unloaded cell."""
        return Configuration(
            positions=self.mesh.p.T[self.helical.independent].copy(),
            curvature=np.zeros(3),
            element_pressure=np.zeros(len(self.solid)),
            segment_tension=np.zeros(len(self.thread)),
            multipliers=np.zeros(GAUGES),
        )

    def all_positions(self, at: Configuration) -> Float[np.ndarray, "nodes 3"]:
        """Positions of every node [mm]."""
        return HelicalFrame(self.helical, at.positions, screw_series(at.curvature, self.reach)).positions

    def volumes(self, at: Configuration) -> Float[np.ndarray, "3"]:
        """Volume of each chamber in one period [mm³]."""
        positions = self.all_positions(at)
        return np.array([c.volume(positions) for c in self.chambers])

    def energy(self, at: Configuration) -> float:
        """Stored energy of one period, without the work of the pressures [N mm]."""
        series = screw_series(at.curvature, self.reach)
        positions = HelicalFrame(self.helical, at.positions, series).positions
        return (
            self.solid.energy(positions)
            + self.thread.energy(positions)
            + self.rod.response(positions, series).energy
            + self.walls.energy(positions)
            + self.period / 2.0 * float(self.rod_stiffness @ at.curvature**2)
        )

    def linearise(
        self, at: Configuration, pressure: Float[np.ndarray, "3"], exact: bool = False
    ) -> Linearisation:
        """Residual and Hessian.

        Parameters
        ----------
        at : configuration.
        pressure : of the chambers [MPa].
        exact : take the element pressures and tensions from the deformation, so that the matrix is the Hessian of the
            energy even away from equilibrium.
        """
        series = screw_series(at.curvature, self.reach)
        frame = HelicalFrame(self.helical, at.positions, series)
        x = frame.positions
        groups = self._connectivities()
        solid = self.solid.response(x, None if exact else at.element_pressure)
        thread = self.thread.response(x, None if exact else at.segment_tension)
        rod = self.rod.response(x, series)

        volume_force = np.zeros((len(x), 3, 3))
        parts = [solid[:2], thread[:2]]
        for k, chamber in enumerate(self.chambers):
            gradient = chamber.gradient(x)
            volume_force[:, :, k] = _scatter(chamber.triangles, gradient, len(x))
            parts.append((-pressure[k] * gradient, -pressure[k] * chamber.hessian(x)))
        parts.append((rod.node_force, rod.node_stiffness))

        data = np.zeros(len(self.pattern))
        force = np.zeros_like(x)
        columns = np.zeros((len(x), 3, 3))
        blocks = []
        for nodes, (local_force, local_stiffness) in zip(groups, parts, strict=True):
            force += _scatter(nodes, local_force, len(x))
            columns += frame.block_columns(nodes, local_stiffness)
            blocks.append(frame.rotate_blocks(nodes, local_stiffness))
        np.add.at(columns, self.rod.nodes, rod.node_curvature)

        grew = False
        walls = self.walls.response(x)
        if walls is not None:
            wall_force, wall_hessian = walls
            force += wall_force
            transformation = frame.transformation()
            columns += (wall_hessian.tocsr() @ frame.curvature_motion.reshape(-1, 3)).reshape(-1, 3, 3)
            reduced = (transformation.T @ wall_hessian @ transformation).tocoo()
            upper = reduced.row <= reduced.col
            entries = (
                reduced.row[upper].astype(np.int64),
                reduced.col[upper].astype(np.int64),
                reduced.data[upper],
            )
            grew = self.pattern.extend(entries[0], entries[1])
            data = np.zeros(len(self.pattern))
            self.pattern.add_entries(data, *entries)
        for group, local in enumerate(blocks):
            self.pattern.add_group(data, group, local)

        free_force, curvature_force = frame.pull_force(force)
        mixed, curvature_curvature = frame.geometric(force)
        pulled, pulled_u = frame.pull_columns(columns)
        volume_free, volume_u = frame.pull_columns(volume_force)
        # `pull_columns` carries the rod's (node, u) block to u once; a cavity node is never an image, so it adds nothing.
        gauge_matrix = self._gauge.reshape(GAUGES, -1)
        rest = self.mesh.p.T[self.helical.independent]
        slip = gauge_matrix @ (at.positions - rest).ravel()
        last = 3 * self.helical.count
        for k in range(GAUGES):
            coupled = np.flatnonzero(gauge_matrix[k])
            self.pattern.add_entries(data, coupled, np.full(len(coupled), last + k), gauge_matrix[k, coupled])
            self.pattern.add_entries(
                data, np.array([last + k]), np.array([last + k]), np.array([-_GAUGE_COMPLIANCE])
            )
        zeros = np.zeros((GAUGES, 3))
        return Linearisation(
            residual=np.concatenate(
                [
                    free_force.ravel() + at.multipliers @ gauge_matrix,
                    slip - _GAUGE_COMPLIANCE * at.multipliers,
                ]
            ),
            curvature_residual=curvature_force
            + rod.curvature_force
            + self.period * self.rod_stiffness * at.curvature,
            data=data,
            node_curvature=np.concatenate([(pulled + mixed).reshape(-1, 3), zeros]),
            node_pressure=np.concatenate([-volume_free.reshape(-1, 3), zeros]),
            curvature_curvature=pulled_u
            + curvature_curvature
            + rod.curvature_stiffness
            + self.period * np.diag(self.rod_stiffness),
            curvature_pressure=-volume_u,
            volume=np.array([c.volume(x) for c in self.chambers]),
            pattern_grew=grew,
            walls_touch=walls is not None,
            frame=frame,
            volume_gradient=solid[2],
            length_gradient=thread[2],
        )

    def advance(self, at: Configuration, step: Step, fraction: float, linear: Linearisation) -> Configuration:
        """Take a fraction of a Newton step, with the condensed pressures and tensions."""
        move = linear.frame.motion(step.positions, step.curvature)
        x = linear.frame.positions
        solid, thread = self.solid, self.thread
        dilation = np.einsum(
            "ea,ea->e", linear.volume_gradient, move[solid.connectivity].reshape(len(solid), -1)
        )
        stretch = np.einsum(
            "sa,sa->s", linear.length_gradient, move[thread.connectivity].reshape(len(thread), -1)
        )
        pressure = solid.bulk_modulus * (solid.dilatation(x) - 1.0 + dilation / solid.volume)
        tension = thread.tension(x) + thread.axial_stiffness * stretch / thread.rest_length
        return Configuration(
            positions=at.positions + fraction * step.positions,
            curvature=at.curvature + fraction * step.curvature,
            element_pressure=at.element_pressure + fraction * (pressure - at.element_pressure),
            segment_tension=at.segment_tension + fraction * (tension - at.segment_tension),
            multipliers=at.multipliers + fraction * step.multipliers,
        )


def _scatter(nodes: np.ndarray, local: np.ndarray, count: int) -> Float[np.ndarray, "nodes 3"]:
    """Sum local nodal vectors into an array over all nodes."""
    dofs = (3 * nodes[:, :, None] + np.arange(3)).ravel()
    return np.bincount(dofs, weights=local.ravel(), minlength=3 * count).reshape(count, 3)
