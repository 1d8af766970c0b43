"""What the tests of `fem_reference` share: differences, rotations, small meshes, and solved coarse cells.

Lengths mm and stresses MPa, as inside the FEM, unless a name says otherwise.
"""

import dataclasses
import functools
import itertools
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array
from numpy.typing import ArrayLike

from fem_reference import ActuatorGeometry, CellState, DoubleHelix, Load, Ogden, PeriodCell, Thread, follow
from fem_reference.cell.equations import CellEquations
from fem_reference.cell.screw_motion import screw_series
from fem_reference.cell.state import Configuration
from fem_reference.materials import BLOCKS, Isochoric, Material, Principal, half_turned, principal
from fem_reference.mesh import BodyMesh, MeshLevel

# The fewest elements that keep the structure: every wall one element thick.
TINY = MeshLevel(2, 4, 2, 2, 1, 1, 1, 0.75)
# Quadratic elements have nodes enough with half as many a side.
QUADRATIC = MeshLevel(2, 2, 1, 2, 1, 1, 1, 1.5, order=2)


# Orders of elements whose kernels are compiled: the one of quadratic elements takes half a minute.
ORDERS = [pytest.param(1, id="linear"), pytest.param(2, id="quadratic", marks=pytest.mark.slow)]


def difference(function: Callable[..., np.ndarray | float], step: float) -> np.ndarray:
    """Fourth-order central difference of ``function`` at zero.

    The error is step⁴/30 of the fifth derivative plus about 1.5 ε/step of the value's magnitude.
    """
    near = np.asarray(function(step)) - np.asarray(function(-step))
    far = np.asarray(function(2.0 * step)) - np.asarray(function(-2.0 * step))
    return (8.0 * near - far) / (12.0 * step)


def relative_error(found: ArrayLike, expected: ArrayLike) -> float:
    """Largest error of an array over its largest entry."""
    expected = np.asarray(expected)
    return float(np.abs(np.asarray(found) - expected).max() / np.abs(expected).max())


def asymmetry(matrix: np.ndarray) -> float:
    """Largest entry of A − Aᵀ over the largest of A, over all matrices of a batch."""
    return relative_error(np.swapaxes(matrix, -1, -2), matrix)


def rotation(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """Rotation by ``angle`` [rad] about ``axis``, by Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


TURN = rotation((1.0, -2.0, 0.5), 1.1)


def points_last(array: ArrayLike, components: int) -> Array:
    """An array over points whose last axes are components, with these first, as compiled loops have it."""
    return jnp.moveaxis(jnp.asarray(array), range(-components, 0), range(components))


def points_first(array: ArrayLike, components: int) -> np.ndarray:
    """The inverse of `points_last`."""
    return np.moveaxis(np.asarray(array), range(components), range(-components, 0))


@jax.jit
def _principal_response(law: Isochoric, F: Array) -> tuple[Principal, Array, Array]:
    at = principal(F)
    stress, dyads = law.response(at)
    return at, stress, half_turned(dyads, at.after)


def isochoric_tangent(
    material: Material, unit: float, deformation_gradient: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stress P and ∂P/∂F over the row-major pairs (iJ), (kL), from those of the principal frame."""
    at, stress, blocks = _principal_response(material.isochoric(unit), points_last(deformation_gradient, 2))
    before = points_first(at.before, 2)
    by_pair = np.empty((3, 3, *blocks.shape[1:]))
    for (i, k), block in zip(BLOCKS, np.asarray(blocks), strict=True):
        by_pair[i, k], by_pair[k, i] = block, np.swapaxes(block, 0, 1)
    tangent = np.einsum("ikab...,...Ja,...Lb->...iJkL", by_pair, before, before)
    return (
        points_first(at.after * stress, 2) @ np.swapaxes(before, -1, -2),
        tangent.reshape(*tangent.shape[:-4], 9, 9),
    )


SIDES = ("x low", "x high", "y low", "y high", "z low", "z high")


def tensor_mesh(axes: Sequence[np.ndarray], order: int = 1) -> BodyMesh:
    """Box of hexahedra between nodes on a grid, with a boundary for each of its SIDES.

    ``axes`` has the nodes' coordinates along x, y and z: ``order`` times the elements, and one more.
    """
    counts = [len(axis) for axis in axes]
    points = np.array(np.meshgrid(*axes, indexing="ij")).T.reshape(-1, 3)
    node = np.arange(len(points)).reshape(counts[::-1])

    def pieces(grid: np.ndarray) -> np.ndarray:
        """Nodes of every element, or facet, of a grid of nodes, in tensor order."""
        starts = itertools.product(*(range(0, count - 1, order) for count in grid.shape))
        return np.array([grid[tuple(slice(i, i + order + 1) for i in start)].ravel() for start in starts])

    faces = [face for axis in (2, 1, 0) for face in (node.take(0, axis), node.take(-1, axis))]
    return BodyMesh(
        points, pieces(node), {name: pieces(np.asarray(f)) for name, f in zip(SIDES, faces, strict=True)}
    )


def element_faces(mesh: BodyMesh) -> np.ndarray:
    """Nodes of the faces of every element: of all elements' first faces, then of their second, and so on."""
    side = mesh.order + 1
    grid = mesh.elements.reshape(-1, side, side, side)
    faces = [grid.take(end, axis) for axis in (3, 2, 1) for end in (0, -1)]
    return np.concatenate([face.reshape(len(grid), -1) for face in faces])


def boundary_nodes(mesh: BodyMesh) -> np.ndarray:
    """Nodes on any boundary."""
    return np.unique(np.concatenate([facets.ravel() for facets in mesh.facets.values()]))


def distorted_block(elements: int = 3, order: int = 1, amplitude: float = 0.12, seed: int = 0) -> BodyMesh:
    """Block of 3 × 2 × 1 mm, its inner nodes moved at random by up to ``amplitude`` of their distance."""
    sides = np.array([3.0, 2.0, 1.0])
    mesh = tensor_mesh([np.linspace(0.0, side, elements * order + 1) for side in sides], order)
    noise = np.random.default_rng(seed).uniform(-amplitude, amplitude, mesh.points.shape)
    noise[boundary_nodes(mesh)] = 0.0
    return dataclasses.replace(mesh, points=mesh.points + noise * sides / (elements * order))


def deformed(points: np.ndarray, seed: int = 1, noise: float = 0.02) -> np.ndarray:
    """Positions (nodes, 3) of a smoothly and strongly deformed body with some noise on top.

    Stretches reach 0.7 and 1.4, as in the actuator's outer wall.
    """
    x, y, z = points.T
    smooth = np.column_stack([1.2 * x + 0.15 * y**2, 0.9 * y - 0.1 * x * z, 0.95 * z + 0.2 * np.sin(x) * y])
    return smooth + noise * np.random.default_rng(seed).uniform(-1.0, 1.0, smooth.shape)


def assemble(nodes: np.ndarray, local: np.ndarray, count: int) -> np.ndarray:
    """Sum of local nodal vectors, by a plain loop: (nodes, 3)."""
    total = np.zeros((count, 3))
    for dofs, vector in zip(nodes, local, strict=True):
        np.add.at(total, dofs, vector.reshape(-1, 3))
    return total


def times(nodes: np.ndarray, local: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Product of the sum of local matrices with a nodal direction (nodes, 3)."""
    moved = direction[nodes].reshape(len(nodes), 3 * nodes.shape[1])
    return assemble(nodes, np.einsum("eab,eb->ea", local, moved), len(direction))


def polar_second_moment(geometry: ActuatorGeometry) -> float:
    """∫ r² dA of the silicone section [m⁴]: a ring's, less the chambers' by Gauss–Legendre quadrature."""
    inner, outer = geometry.chamber_inner_radius, geometry.chamber_outer_radius
    point, weight = np.polynomial.legendre.leggauss(12)
    radius = 0.5 * (inner + outer) + 0.5 * (outer - inner) * point
    span = np.array([2.0 * geometry.chamber_half_angle(float(r)) for r in radius])
    chamber = 0.5 * (outer - inner) * np.sum(weight * span * radius**3)
    ring = np.pi / 32.0 * (geometry.body_diameter**4 - geometry.cavity_diameter**4)
    return float(ring - 3.0 * chamber)


def bent_configuration(
    equations: CellEquations,
    curvature: ArrayLike,
    seed: int = 0,
    expansion: float = 1e-3,
    noise: float = 1e-3,
    stretch: float = 1.0,
) -> Configuration:
    """An admissible configuration far from equilibrium.

    Every node follows the screw, stretched along the rod, to its height; the section expands by
    ``expansion``, which keeps the cavity off the barrier's wall; every node moves by up to ``noise`` [mm].
    """
    rest = equations.rest()
    series = screw_series(np.asarray(curvature), equations.reach, stretch)
    section = rest.positions * [1.0 + expansion, 1.0 + expansion, 0.0]
    positions = np.empty_like(section)
    for i, z in enumerate(rest.positions[:, 2]):
        motion = series.at(float(z))[0]
        positions[i] = motion[:3, :3] @ section[i] + motion[:3, 3]
    positions += noise * np.random.default_rng(seed).uniform(-1.0, 1.0, positions.shape)
    return dataclasses.replace(rest, positions=positions, strain=np.append(curvature, stretch))


def load_of(pressure: ArrayLike, moment: ArrayLike | None = None, curvature: ArrayLike | None = None) -> Load:
    """`Load` from arrays."""

    def triple(values: ArrayLike) -> tuple[float, float, float]:
        first, second, third = (float(v) for v in np.asarray(values))
        return first, second, third

    def given(values: ArrayLike | None) -> tuple[float, float, float] | None:
        return None if values is None else triple(values)

    return Load(triple(pressure), moment=given(moment), curvature=given(curvature))


@functools.cache
def tiny_equations(order: int = 1) -> CellEquations:
    """The paper's cell on the fewest elements."""
    level = dataclasses.replace(TINY, order=order)
    return CellEquations(ActuatorGeometry(), Ogden(), DoubleHelix(), Thread(), level)


@functools.cache
def tiny_cell() -> PeriodCell:
    """The paper's cell on the fewest elements."""
    return PeriodCell(level=TINY)


@functools.cache
def coarse_cell() -> PeriodCell:
    """The paper's cell on the coarse mesh."""
    return PeriodCell(level="coarse")


@functools.cache
def chamber_one_path() -> dict[int, CellState]:
    """Free bending under 5, 15 and 25 kPa in chamber 1, by the pressure in kPa."""
    loads = [Load((kpa * 1e3, 0.0, 0.0)) for kpa in (5, 15, 25)]
    return {round(s.pressure[0] / 1e3): s for s in follow(coarse_cell(), loads)}


# Each folder's conftest takes these fixtures in; what they return is made once a process.


@pytest.fixture(scope="session")
def equations() -> CellEquations:
    return tiny_equations()


@pytest.fixture(scope="session")
def cell() -> PeriodCell:
    return coarse_cell()


@pytest.fixture(scope="session")
def bending_path() -> dict[int, CellState]:
    return chamber_one_path()


@pytest.fixture(scope="session")
def small_cell() -> PeriodCell:
    return tiny_cell()
