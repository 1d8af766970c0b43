"""The cell has the section's symmetries: mirrored and turned loads give mirrored and turned states."""

import math

import numpy as np
import pytest

from fem_reference import DoubleHelix, Load, PeriodCell
from tests.fem_fixtures import TINY, load_of

# Nodes of the mesh lie on their arcs to 1e-8 mm; what that is worth in volumes and energies is 1e-7 of them.
MESH = 1e-5


def test_chambers_2_and_3_are_mirror_images_at_psi_0(small_cell):
    """y ↦ −y swaps chambers 2 and 3, and takes the axial vectors u and m to (−u1, u2, −u3)."""
    pressure, moment = (8e3, 12e3, 3e3), (1e-4, -2e-4, 5e-5)
    state = small_cell.solve(Load(pressure, moment=moment))
    mirror = np.array([-1.0, 1.0, -1.0])
    swap = [0, 2, 1]
    image = small_cell.solve(load_of(np.take(pressure, swap), mirror * moment))
    size = float(np.linalg.norm(state.curvature))
    # All three components are at work.
    assert np.abs(state.curvature).min() > 0.05 * size
    np.testing.assert_allclose(image.curvature, mirror * state.curvature, rtol=0, atol=MESH * size)
    np.testing.assert_allclose(image.volume[swap], state.volume, rtol=MESH)
    assert image.energy == pytest.approx(state.energy, rel=MESH)
    change = np.zeros((6, 6))
    change[:3, :3] = np.diag(mirror)
    change[3:, 3:] = np.eye(3)[swap]
    scale = np.sqrt(np.abs(np.diag(state.hessian)))
    difference = image.hessian - change @ state.hessian @ change.T
    assert np.abs(difference / np.outer(scale, scale)).max() <= MESH


def test_a_turn_of_winding_and_pressures_turns_the_answer(small_cell):
    """ψ + 120° and the pressures moved on by one chamber: the same section, seen from 120° further."""
    turned_cell = PeriodCell(winding=DoubleHelix(psi=2.0 * math.pi / 3.0), level=TINY)
    pressure = (10e3, 4e3, 1e3)
    state = small_cell.solve(Load(pressure))
    turned = turned_cell.solve(Load((pressure[2], pressure[0], pressure[1])))
    c, s = -0.5, math.sqrt(0.75)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    size = float(np.linalg.norm(state.curvature))
    np.testing.assert_allclose(turned.curvature, turn @ state.curvature, rtol=0, atol=MESH * size)
    np.testing.assert_allclose(np.roll(turned.volume, -1), state.volume, rtol=MESH)
    assert turned.energy == pytest.approx(state.energy, rel=MESH)
