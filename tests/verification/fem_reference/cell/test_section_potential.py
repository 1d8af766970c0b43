"""One potential: the cell's moment, volumes and Hessian are derivatives of its energy, and of each other."""

import numpy as np
import pytest

from fem_reference import Load
from tests.fem_fixtures import load_of

PRESSURE = (10e3, 6e3, 3e3)
MOMENT = (2e-4, -3e-4, 1e-4)
# Steps of 0.2 1/m and 0.2 kPa, and half of that.
STEPS = (0.2, 0.1)
UNITS = np.array([1.0, 1.0, 1.0, 1e3, 1e3, 1e3])


@pytest.fixture(scope="module")
def state(cell):
    return cell.solve(Load(PRESSURE, moment=MOMENT))


@pytest.fixture(scope="module")
def differences(cell, state) -> list[tuple[np.ndarray, np.ndarray]]:
    """Central differences of the energy and of (m, −V) in y = (u, p), in UNITS, for each of STEPS.

    The neighbours are states of imposed curvature; contact with the walls has not begun.
    """
    y = np.concatenate([state.curvature, state.pressure])

    def neighbour(y):
        found = cell.solve(load_of(y[3:], curvature=y[:3]), start=state)
        return found.energy, np.concatenate([found.moment, -found.volume]) * UNITS

    results = []
    for step in STEPS:
        gradient, hessian = np.zeros(6), np.zeros((6, 6))
        for i, e in enumerate(np.eye(6)):
            (up, up_slope), (down, down_slope) = (neighbour(y + sign * step * UNITS * e) for sign in (1, -1))
            gradient[i] = (up - down) / (2.0 * step)
            hessian[i] = (up_slope - down_slope) / (2.0 * step)
        results.append((gradient, hessian))
    return results


def extrapolated(coarse: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Richardson's value of two central differences, a step apart by two: fourth order."""
    return (4.0 * fine - coarse) / 3.0


def test_moment_and_volumes_are_the_slopes_of_the_energy(state, differences):
    exact = np.concatenate([state.moment, -state.volume]) * UNITS
    (coarse, _), (fine, _) = differences
    # Each entry's scale is that of its kind: moments of 3e-4 N m, volumes of 2e-5 m² (per kPa: 2e-2).
    scale = np.repeat([np.abs(exact[:3]).max(), np.abs(exact[3:]).max()], 3)
    # The step's own error, as two steps tell it, falls by four; what is left of fourth order is under 1e-6.
    errors = [np.abs((g - exact) / scale).max() for g in (coarse, fine)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    assert np.abs((extrapolated(coarse, fine) - exact) / scale).max() <= 1e-6


def test_hessian_is_the_slope_of_moment_and_volumes(state, differences):
    exact = state.hessian * np.outer(UNITS, UNITS)
    (_, coarse), (_, fine) = differences
    scale = np.sqrt(np.outer(np.abs(np.diag(exact)), np.abs(np.diag(exact))))
    errors = [np.abs((h - exact) / scale).max() for h in (coarse, fine)]
    # 5e-4 of the scale at the larger step, and a quarter of it at the smaller.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert np.abs((extrapolated(coarse, fine) - exact) / scale).max() <= 2e-5


def test_hessian_is_symmetric_and_of_the_right_signs(state):
    hessian = state.hessian
    np.testing.assert_array_equal(hessian, hessian.T)
    # A stable section is stiff in bending and twist, and its chambers grow under their own pressure: ∂V/∂p =
    # −∂²Π/∂p².
    assert np.linalg.eigvalsh(hessian[:3, :3]).min() > 0.0
    assert np.all(np.diag(hessian)[3:] < 0.0)
    assert state.stable


def test_the_differences_themselves_are_symmetric(differences):
    """m by p and −V by u come from different states, so that only a potential makes them meet."""
    hessian = extrapolated(*(h for _, h in differences))
    scale = np.sqrt(np.outer(np.abs(np.diag(hessian)), np.abs(np.diag(hessian))))
    assert np.abs((hessian - hessian.T) / scale).max() <= 4e-5
