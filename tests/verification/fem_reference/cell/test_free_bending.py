"""Free bending of the paper's cell on the coarse mesh: direction, magnitude, and what hardly matters."""

import numpy as np
import pytest

from fem_reference import Load, PeriodCell, Thread
from tests.fem_fixtures import load_of, polar_second_moment, relative_error

LENGTH = 0.06


def bending_angle(state) -> float:
    """Bending of the actuator's length at this curvature [deg]."""
    return float(np.rad2deg(LENGTH * np.hypot(*state.curvature[:2])))


@pytest.fixture(scope="module")
def rest(cell):
    return cell.solve(Load((0.0, 0.0, 0.0)))


def test_without_load_the_cell_stays_as_it_is(cell, rest):
    assert rest.energy == 0.0
    assert rest.stable
    # The rod's barrier presses with 0.6 kPa on a cavity that the winding does not hold alike all round.
    np.testing.assert_allclose(rest.curvature, 0.0, rtol=0, atol=1e-4)
    mesh, period = cell.equations.mesh.points, cell.equations.period
    undeformed = [chamber.volume(mesh) / period for chamber in cell.equations.chambers]
    # 0.6 kPa on the cavity, through a stiff inner wall; 5 kPa in a chamber itself make it grow by a tenth.
    np.testing.assert_allclose(rest.volume * 1e6, undeformed, rtol=5e-4)


def test_the_unloaded_section_is_stiffer_than_the_silicone_alone(cell, rest):
    """EI > 3 μ I and GJ > μ I_p: the winding can only add to a beam of incompressible silicone."""
    stiffness = np.diag(rest.hessian)[:3]
    polar = polar_second_moment(cell.geometry)
    modulus = cell.material.shear_modulus
    # With three-fold symmetry, as the section has but for the winding's crossings, I = I_p/2 about any axis.
    assert np.all(stiffness[:2] > 3.0 * modulus * polar / 2.0)
    assert stiffness[2] > modulus * polar
    assert stiffness[0] == pytest.approx(stiffness[1], rel=0.01)
    # A prototype found 2.45e-4 N m²; refinement is worth 2 %.
    assert stiffness[:2].mean() == pytest.approx(2.45e-4, rel=0.03)


def test_chamber_1_alone_bends_towards_minus_x_in_its_plane(bending_path):
    for state in bending_path.values():
        assert state.curvature[1] < 0.0
        # The mesh's asymmetry of 1e-8 mm, and the loop's tolerance.
        assert np.abs(state.curvature[[0, 2]]).max() <= 1e-6 * abs(state.curvature[1])


@pytest.mark.parametrize(("kilopascal", "angle"), [(5, 5.0), (15, 16.7), (25, 31.6)])
def test_free_bending_is_the_prototypes_within_three_per_cent(bending_path, kilopascal, angle):
    """Its mesh of 1 100 elements and ours of 1 440 differ by about the 2 % that refinement is worth."""
    assert bending_angle(bending_path[kilopascal]) == pytest.approx(angle, rel=0.03)


def test_pressure_inflates_its_chamber_and_does_work(bending_path, rest):
    states = [rest, *bending_path.values()]
    volumes = np.array([state.volume[0] for state in states])
    energies = np.array([state.energy for state in states])
    assert np.all(np.diff(volumes) > 0.0)
    assert np.all(np.diff(energies) < 0.0)
    # With m = 0 all along, Π falls by ∫ V dp: more than by the volume at a step's start, less than by that at
    # its end.
    pressures = np.array([state.pressure[0] for state in states])
    falls = -np.diff(energies) / np.diff(pressures)
    assert np.all((volumes[:-1] < falls) & (falls < volumes[1:]))


@pytest.mark.parametrize(("factor", "most"), [(10.0, 2e-3), (0.1, 1e-2)])
def test_the_threads_modulus_hardly_matters(bending_path, factor, most):
    """At EA = 771 N it is inextensible beside the silicone: +0.04 % at ten times that, −0.4 % at a tenth."""
    cell = PeriodCell(level="coarse", thread=Thread(young_modulus=factor * Thread().young_modulus))
    changed = bending_angle(cell.solve(Load((15e3, 0.0, 0.0)), start=bending_path[15]))
    assert changed == pytest.approx(bending_angle(bending_path[15]), rel=most)
    # It does matter a little: a stiffer thread is not a no-op.
    assert changed != pytest.approx(bending_angle(bending_path[15]), rel=1e-5)


def test_imposing_the_free_curvature_takes_no_moment(cell, bending_path):
    free = bending_path[15]
    held = cell.solve(load_of(free.pressure, curvature=free.curvature))
    # The bending stiffness is 2.4e-4 N m² and u is good to 1e-8 N mm of moment.
    np.testing.assert_allclose(held.moment, 0.0, rtol=0, atol=1e-10)
    np.testing.assert_allclose(held.volume, free.volume, rtol=1e-8)
    assert relative_error(held.hessian, free.hessian) <= 1e-6
