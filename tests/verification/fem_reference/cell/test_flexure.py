"""Flexure of a block to a large angle, against Rivlin's exact solution.

A block of an incompressible neo-Hookean solid, W = μ/2 (I₁ − 3), of thickness H is bent in plane strain by ψ
per length, its curved faces free. Planes across it turn about one axis and its layers become cylinders, of
radii r² = 2X/ψ + constant. No traction on the inner and the outer face wants r₁ r₂ = 1/ψ²; the couple per
width is

    M = μ ψ² (r₂⁴ − r₁⁴)/8 − μ/(2 ψ²) ln(r₂/r₁)

(Rivlin 1949, Large elastic deformations of isotropic materials V, Proc. R. Soc. A 195).
"""

import numpy as np
import pytest
from jaxtyping import Float

from fem_reference import Ogden
from tests.fem_fixtures import tensor_mesh
from tests.solid_problem import solve_body

THICKNESS, LENGTH, WIDTH, BEND = 1.0, 2.0, 0.25, 0.8
MU, BULK = 0.1, 1e5
# r₂² − r₁² = 2H/ψ keeps the volume.
_SQUARES = THICKNESS / BEND + np.sqrt((THICKNESS / BEND) ** 2 + 1.0 / BEND**4) * np.array([-1.0, 1.0])
INNER, OUTER = np.sqrt(np.abs(_SQUARES))


def bent(points: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "nodes 3"]:
    """Where the exact solution has the points of the block."""
    x, y, z = points.T
    radius, angle = np.sqrt(2.0 * x / BEND + INNER**2), BEND * y
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def errors(elements: int, order: int) -> tuple[float, float]:
    """Of the couple on the end and of the outer radius half way, as parts of the exact ones."""
    counts = (elements, elements, 1)
    sizes = (THICKNESS, LENGTH / 2.0, WIDTH)
    axes = [np.linspace(0.0, size, n * order + 1) for size, n in zip(sizes, counts, strict=True)]
    mesh = tensor_mesh(axes, order)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[:, 2] = True
    held[mesh.nodes("y low")] = held[mesh.nodes("y high")] = True
    material = Ogden((MU * 1e6,), (2.0,), BULK * 1e6)
    found = solve_body(mesh, material, bent(mesh.points), held, np.zeros_like(mesh.points))
    end = mesh.nodes("y high")
    couple = np.cross(found.positions[end], found.reaction[end])[:, 2].sum() / WIDTH
    exact = MU * (BEND**2 * (OUTER**4 - INNER**4) / 8.0 - np.log(OUTER / INNER) / (2.0 * BEND**2))
    half_way = np.isclose(mesh.points[:, 0], THICKNESS) & np.isclose(mesh.points[:, 1], LENGTH / 4.0)
    radius = np.linalg.norm(found.positions[half_way][:, :2], axis=1).mean()
    return abs(couple / exact - 1.0), abs(radius / OUTER - 1.0)


def test_the_closed_form_keeps_volumes_and_leaves_the_faces_free():
    radii = bent(np.array([[0.0, 0.0, 0.0], [THICKNESS, 0.0, 0.0]]))[:, 0]
    np.testing.assert_allclose(radii, [INNER, OUTER], rtol=1e-12)
    # The radial stress that balances the hoop's is μ/2 (ψ² r² + 1/(ψ r)²) and a constant, on both faces one.
    inner, outer = (BEND**2 * r**2 + 1.0 / (BEND * r) ** 2 for r in (INNER, OUTER))
    assert inner == pytest.approx(outer, rel=1e-12)


@pytest.mark.parametrize(("order", "meshes"), [(1, (4, 16)), (2, (2, 6))])
def test_couple_and_radius_converge_to_the_exact_solution(order, meshes):
    """The couple as an energy does, the radius as a displacement; between a mesh and one much finer.

    The bulk modulus, a million times the shear modulus, leaves 3e-6 of the couple.
    """
    coarse, fine = (np.array(errors(elements, order)) for elements in meshes)
    observed = np.log(coarse / fine) / np.log(meshes[1] / meshes[0])
    assert (observed >= np.array([2.0 * order, order + 1.0]) - 0.4).all()
    assert fine.max() < 0.01
