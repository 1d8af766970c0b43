"""Free bending against the exact arc, and the integrated rod against free bending."""

import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel import Rod
from tests.unit.rodmodel import synthetic

# JAX compiles each of these rods; `test_core_against_reference.py` holds the C core to be the same.
pytestmark = pytest.mark.slow

PRESSURES = [[0.0, 0.0, 0.0], [10e3, 0.0, 0.0], [70e3, 0.0, 0.0], [30e3, 20e3, 10e3], [0.0, 55e3, 40e3]]


@pytest.fixture(scope="module")
def rod() -> Rod:
    return synthetic.rod(synthetic.bending_law())


def test_a_planar_rod_is_a_circular_arc(rod: Rod) -> None:
    """Chamber 1 alone: a circle of radius 1/|u₂| towards −x, then the cap along its tangent."""
    solution = rod.solve([50e3, 0.0, 0.0])
    u = np.asarray(rod.section.free_curvature(jnp.array([50e3, 0.0, 0.0])))
    np.testing.assert_allclose(u[[0, 2]], 0.0, atol=1e-11)
    assert u[1] < 0.0
    radius, angle = -1.0 / u[1], -u[1] * 0.06
    x = -radius * (1.0 - np.cos(angle)) - 0.006 * np.sin(angle)
    z = radius * np.sin(angle) + 0.006 * np.cos(angle)
    np.testing.assert_allclose(solution.tip_position, [x, 0.0, z], atol=1e-14)
    np.testing.assert_allclose(solution.bending_angle, angle, rtol=1e-14)
    np.testing.assert_allclose(solution.bending_plane, 0.0, atol=1e-11)
    s = np.linspace(0.0, 0.06, 13)
    circle = np.stack([-radius * (1.0 - np.cos(s / radius)), 0.0 * s, radius * np.sin(s / radius)], axis=1)
    np.testing.assert_allclose(solution.centreline(s), circle, atol=1e-14)


def test_loads_of_nothing_give_the_arc(rod: Rod) -> None:
    """The integrated rod under zero loads is the closed form: to 1e-8 of the length, ten times what the
    interpolation between steps of tolerance 1e-10 was seen to err."""
    nothing = jnp.zeros(3)
    for pressure in PRESSURES:
        arc, integrated = rod.solve(pressure), rod.solve(pressure, nothing, nothing, nothing)
        np.testing.assert_allclose(integrated.tip_position, arc.tip_position, atol=1e-8 * 0.066)
        np.testing.assert_allclose(integrated.tip_rotation, arc.tip_rotation, atol=1e-8)
        np.testing.assert_allclose(integrated.bending_angle, arc.bending_angle, atol=1e-8)
        np.testing.assert_allclose(integrated.chamber_volume, arc.chamber_volume, rtol=1e-8)
        s = np.linspace(0.0, 0.066, 12)
        np.testing.assert_allclose(integrated.centreline(s), arc.centreline(s), atol=1e-8 * 0.066)
        np.testing.assert_allclose(integrated.frames(s), arc.frames(s), atol=1e-8)
        np.testing.assert_allclose(integrated.curvature(s), arc.curvature(s), atol=1e-8 / 0.06)


def test_a_rod_that_also_twists_is_a_helix(rod: Rod) -> None:
    """Radius κ/(κ² + τ²), turn by √(κ² + τ²) per length, rise by τ/√(κ² + τ²): the geometry of a helix."""
    pressure = jnp.array([40e3, 55e3, 0.0])
    u = np.asarray(rod.section.free_curvature(pressure))
    assert abs(u[2]) > 1.0
    bending_squared, twist = u[0] ** 2 + u[1] ** 2, u[2]
    total = np.sqrt(bending_squared + twist**2)
    s = np.linspace(0.0, 0.06, 7)
    r = np.asarray(rod.solve(pressure).centreline(s))
    # Along the axis of the screw, u in the base frame, and the chord across it.
    axis = u / total
    rise = r @ axis
    np.testing.assert_allclose(rise, s * twist / total, atol=1e-14)
    across = np.linalg.norm(r - rise[:, None] * axis, axis=1)
    radius = np.sqrt(bending_squared) / total**2
    np.testing.assert_allclose(across, 2.0 * radius * np.abs(np.sin(0.5 * total * s)), atol=1e-14)
