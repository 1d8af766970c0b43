"""Similar bodies bend by the same angles: λ times the lengths, μ times the moduli and the pressures.

The finite elements compute each body in units of its own (`Units`), in which a body and all that are similar
to it are one. They differ by the rounding of the factors, which equilibria near a soft state magnify; the
solver leaves residuals of a millionth of the nodes' forces. A length or a stress that was left out of the
scaling shows: with those of mesh and contact kept, a body of half the size bends by 1.25 % more at 10 kPa.
"""

from dataclasses import replace

import meshio
import numpy as np
import pytest

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad, CellState, Load, PeriodCell, follow
from fem_reference.cell.equations import CellEquations
from fem_reference.design import Design
from fem_reference.geometry import DoubleHelix, NoWinding, Ring, SixHelix, Thread
from fem_reference.io import write_vtk
from fem_reference.mesh import MeshLevel
from tests.fem_fixtures import TINY
from tests.similar_designs import scaled

# The second has no factor that is a power of two in lengths.
LENGTH, MODULUS = 3.0, 0.25
ALIKE = 1e-6
PAPER = Design(end_compliance=0.23e-3)
# Even counts along the chambers' sides, under a cap.
CAPPED = MeshLevel(2, 4, 1, 2, 1, 1, 1, 1.5)


def load_of(similar: bool, pressure: tuple[float, float, float], moment: tuple[float, float, float]) -> Load:
    """The load of the paper's body, or of the similar one."""
    stress, turn = (MODULUS, MODULUS * LENGTH**3) if similar else (1.0, 1.0)
    first, second, third = (stress * p for p in pressure)
    about_x, about_y, about_z = (turn * m for m in moment)
    return Load((first, second, third), (about_x, about_y, about_z))


def assert_alike(own: CellState, other: CellState, length: float, modulus: float, within: float) -> None:
    """All that a cell tells, each over its own factor; small components count as shares of the largest."""
    area, moment = length**2, modulus * length**3
    steps = np.repeat([length, 1.0 / modulus], 3)
    for found, expected in (
        (length * other.curvature, own.curvature),
        (other.moment / moment, own.moment),
        (other.volume / area, own.volume),
        (np.array(other.stretch), np.array(own.stretch)),
        (np.array(other.energy / (modulus * area)), np.array(own.energy)),
        (other.hessian / (modulus * area) / np.outer(steps, steps), own.hessian),
    ):
        # Free bending leaves a residual for a moment.
        size = max(np.abs(expected).max(), 1e-6 if expected is own.moment else 0.0)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=within * size)
    assert other.stable == own.stable


def walls_touch(cell: PeriodCell, state: CellState) -> bool:
    equations: CellEquations = cell.equations
    return bool(np.isfinite(equations.walls.minimum_distance(equations.all_positions(state.configuration))))


def test_a_cell_bends_alike_before_and_after_its_walls_touch():
    cells = [PeriodCell.of(design, "coarse") for design in (PAPER, scaled(PAPER, LENGTH, MODULUS))]
    loads = [((10e3, 0.0, 0.0), (0.0,) * 3), ((36e3, 2e3, 0.0), (0.0,) * 3)]
    paths = [
        list(follow(cell, [load_of(similar, *load) for load in loads]))
        for cell, similar in zip(cells, (False, True), strict=True)
    ]
    touching = [[walls_touch(cell, state) for state in path] for cell, path in zip(cells, paths, strict=True)]
    assert touching == [[False, True]] * 2
    for own, other in zip(*paths, strict=True):
        assert_alike(own, other, LENGTH, MODULUS, ALIKE)


def test_half_the_size_is_the_same_to_the_last_bit():
    bodies = PAPER, scaled(PAPER, 0.5, 1.0)
    own, half = (PeriodCell.of(body, TINY).solve(Load((8e3, 1e3, 0.0))) for body in bodies)
    np.testing.assert_array_equal(0.5 * half.curvature, own.curvature)
    np.testing.assert_array_equal(4.0 * half.volume, own.volume)
    assert half.iterations == own.iterations


@pytest.mark.parametrize(
    ("winding", "thread"),
    [
        (Ring(), Thread()),
        (SixHelix(0.1), Thread()),
        (NoWinding(), Thread()),
        (DoubleHelix(0.3, 2e-3), Thread(bends=True)),
        (DoubleHelix(), Thread(coupling="axis", slack_share=1e-4)),
    ],
)
def test_so_do_cells_of_every_winding_and_thread_under_a_moment(winding, thread):
    design = replace(PAPER, winding=winding, thread=thread)
    own, other = (
        PeriodCell.of(body, TINY).solve(load_of(similar, (3e3, 1e3, 0.0), (2e-4, 1e-4, 1e-4)))
        for body, similar in ((design, False), (scaled(design, LENGTH, MODULUS), True))
    )
    assert_alike(own, other, LENGTH, MODULUS, ALIKE)


def test_an_actuator_bends_alike_under_pressures_tip_loads_and_its_weight():
    short = replace(PAPER, geometry=ActuatorGeometry(body_length=9e-3, cap_length=3e-3))
    force = MODULUS * LENGTH**2
    # A density with which the weight scales as forces do.
    similar = replace(scaled(short, LENGTH, MODULUS), density=short.density * MODULUS / LENGTH)
    own, other = (
        Actuator.of(body, CAPPED).solve(
            ActuatorLoad(
                (stress * 12e3, 0.0, stress * 3e3),
                tip_force=(0.0, f * 5e-3, 0.0),
                tip_moment=(0.0, f * length * 1e-4, 0.0),
                gravity=(0.0, 9.81, -9.81),
            )
        )
        for body, length, stress, f in (
            (short, 1.0, 1.0, 1.0),
            (similar, LENGTH, MODULUS, force),
        )
    )
    np.testing.assert_allclose(other.bending_angle, own.bending_angle, rtol=ALIKE)
    np.testing.assert_allclose(other.bending_plane, own.bending_plane, rtol=ALIKE)
    size = 12e-3
    np.testing.assert_allclose(other.tip_position / LENGTH, own.tip_position, rtol=0.0, atol=ALIKE * size)
    np.testing.assert_allclose(other.chamber_volume / LENGTH**3, own.chamber_volume, rtol=ALIKE)
    np.testing.assert_allclose(other.strain_energy / (force * LENGTH), own.strain_energy, rtol=ALIKE)
    np.testing.assert_allclose(other.thread_tension / force, own.thread_tension, rtol=ALIKE)
    curvature, bend = other.shape.curvature * LENGTH, np.abs(own.shape.curvature).max()
    np.testing.assert_allclose(curvature, own.shape.curvature, rtol=0.0, atol=ALIKE * bend)
    # Forces at the base balance the loads but for what the solver leaves on the nodes, 1e-5 N and less.
    base, expected = other.settled.base_force / force, own.settled.base_force
    np.testing.assert_allclose(base, expected, rtol=0.0, atol=1e-6)
    base, expected = other.settled.base_moment / (force * LENGTH), own.settled.base_moment
    np.testing.assert_allclose(base, expected, rtol=0.0, atol=1e-6 * size)


def test_files_for_paraview_are_in_millimetres_kilopascals_and_newtons(tmp_path):
    grids = []
    for body, similar in ((PAPER, False), (scaled(PAPER, LENGTH, MODULUS), True)):
        cell = PeriodCell.of(body, TINY)
        state = cell.solve(load_of(similar, (3e3, 0.0, 0.0), (0.0,) * 3))
        write_vtk(cell, state, tmp_path / "cell.vtu")
        grids.append(meshio.read(tmp_path / "cell.vtu"))
    own, other = grids
    # The outer radius and some ballooning.
    assert 18.0 < np.abs(other.points[:, :2]).max() < 1.1 * 18.0
    for found, expected, factor in (
        (other.points, own.points, LENGTH),
        (other.point_data["displacement_mm"], own.point_data["displacement_mm"], LENGTH),
        (other.cell_data["pressure_kpa"][0], own.cell_data["pressure_kpa"][0], MODULUS),
        (other.cell_data["tension_n"][1], own.cell_data["tension_n"][1], MODULUS * LENGTH**2),
    ):
        np.testing.assert_allclose(found / factor, expected, rtol=0.0, atol=ALIKE * np.abs(expected).max())
