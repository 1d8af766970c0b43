"""Torsion of a solid cylinder to a large angle, against Rivlin's exact solution.

A cylinder of radius a of an incompressible neo-Hookean solid, W = μ/2 (I₁ − 3), that is twisted by ψ per
length and held at its length keeps its radius. The torque is M = π/2 μ ψ a⁴ and the thrust of its ends
N = −π/4 μ ψ² a⁴ (Rivlin 1949, Large elastic deformations of isotropic materials VI, Phil. Trans. A 242).
"""

import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.mesh import BodyMesh
from tests.fem_fixtures import tensor_mesh
from tests.solid_problem import solve_body

RADIUS, LENGTH, TWIST = 1.0, 0.5, 0.8
MU, BULK = 0.1, 1e4


def cylinder(elements: int, order: int) -> BodyMesh:
    """A square's grid mapped onto the disc."""
    axis = np.linspace(-1.0, 1.0, elements * order + 1)
    box = tensor_mesh([axis, axis, np.linspace(0.0, LENGTH, elements // 2 * order + 1)], order)
    x, y, z = box.points.T
    disc = np.column_stack([x * np.sqrt(1.0 - 0.5 * y**2), y * np.sqrt(1.0 - 0.5 * x**2), z])
    return BodyMesh(disc * [RADIUS, RADIUS, 1.0], box.elements, box.facets)


def end_loads(elements: int, order: int) -> tuple[float, float]:
    """Torque [N mm] and thrust [N] on the twisted end."""
    mesh = cylinder(elements, order)
    x, y, z = mesh.points.T
    angle = TWIST * z
    turned = np.column_stack(
        [x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z]
    )
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[mesh.nodes("z low")] = held[mesh.nodes("z high")] = True
    found = solve_body(mesh, Ogden((MU * 1e6,), (2.0,), BULK * 1e6), turned, held, np.zeros_like(turned))
    top = mesh.nodes("z high")
    position, force = found.positions[top], found.reaction[top]
    return float(np.cross(position, force)[:, 2].sum()), float(force[:, 2].sum())


@pytest.mark.parametrize(("order", "meshes"), [(1, (4, 8, 16)), (2, (4, 8))])
def test_torque_and_thrust_converge_to_the_exact_solution(order, meshes):
    exact = np.pi * MU * RADIUS**4 * np.array([TWIST / 2.0, -(TWIST**2) / 4.0])
    errors = np.array([np.abs(np.array(end_loads(n, order)) - exact) / np.abs(exact) for n in meshes])
    observed = np.log2(errors[:-1] / errors[1:])
    assert (observed[-1] >= 2.0 * order - 0.4).all()
