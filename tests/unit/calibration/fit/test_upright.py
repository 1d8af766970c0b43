"""A section that gives way sideways is given back its stand, and nothing else changes."""

import numpy as np
import pytest

from calibration.fit.upright import UPRIGHT, leaned_over, stood_upright


def state(softest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gradient, Hessian and soft direction of a random state."""
    rng = np.random.default_rng(0)
    frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    hessian = rng.standard_normal((6, 6))
    hessian += hessian.T
    hessian[:3, :3] = frame @ np.diag([softest, 1.0, 1.6]) @ frame.T
    return rng.standard_normal(6), hessian, frame[:, 0]


@pytest.mark.parametrize("softest", [-25.0, -0.1, 0.2])
def test_only_the_soft_direction_of_a_held_state_changes(softest):
    gradient, hessian, v = state(softest)
    applied = np.array([0.3, -0.2, 0.1])
    both, stiffness = stood_upright(
        np.stack([gradient, gradient]),
        np.stack([hessian, hessian]),
        np.stack([applied, applied]),
        np.array([False, True]),
        # Bent along the soft direction's part in the section, and not across it.
        np.stack([40.0 * v, 40.0 * v]),
    )
    np.testing.assert_array_equal(both[0], gradient)
    np.testing.assert_array_equal(stiffness[0], hessian)
    found, matrix = both[1], stiffness[1]
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12)
    np.testing.assert_allclose(matrix[:3, :3] @ v, UPRIGHT * v, atol=1e-12)
    assert v @ found[:3] == pytest.approx(v @ applied, abs=1e-12)
    np.testing.assert_allclose(v @ matrix[:3, 3:], 0.0, atol=1e-12)
    # Across v all is as it was, and so is what belongs to the pressures alone.
    across = np.eye(3) - np.outer(v, v)
    np.testing.assert_allclose(across @ found[:3], across @ gradient[:3], atol=1e-12)
    np.testing.assert_allclose(across @ matrix[:3, :3], across @ hessian[:3, :3], atol=1e-12)
    np.testing.assert_allclose(across @ matrix[:3, 3:], across @ hessian[:3, 3:], atol=1e-12)
    np.testing.assert_array_equal(found[3:], gradient[3:])
    np.testing.assert_array_equal(matrix[3:, 3:], hessian[3:, 3:])


def test_a_held_state_that_is_stiff_enough_is_as_it_was():
    gradient, hessian, _ = state(0.8)
    found, matrix = stood_upright(
        gradient[None], hessian[None], np.zeros((1, 3)), np.array([True]), np.zeros((1, 3))
    )
    np.testing.assert_array_equal(found[0], gradient)
    np.testing.assert_array_equal(matrix[0], hessian)


@pytest.mark.parametrize("softest", [0.1, 0.4])
def test_a_section_that_softens_sideways_keeps_its_state_and_gets_the_least_stiffness(softest):
    """Bent about y; the soft direction is x, and no moment changes."""
    hessian = np.diag([softest, 1.0, 1.6, -1.0, -1.0, -1.0])
    hessian[0, 3] = hessian[3, 0] = 0.3
    gradient = np.arange(6.0)
    found, matrix = stood_upright(
        gradient[None], hessian[None], np.ones((1, 3)), np.array([False]), np.array([[0.5, -40.0, 0.1]])
    )
    np.testing.assert_array_equal(found[0], gradient)
    expected = hessian.copy()
    expected[0, 0] = UPRIGHT
    np.testing.assert_allclose(matrix[0], expected, atol=1e-12)


@pytest.mark.parametrize("curvature", [(-40.0, 0.5, 0.1), (0.0, 0.0, 0.0)])
def test_a_section_that_is_soft_in_its_plane_or_straight_is_as_it_was(curvature):
    hessian = np.diag([0.1, 1.0, 1.6, -1.0, -1.0, -1.0])[None]
    _, matrix = stood_upright(
        np.zeros((1, 6)), hessian, np.zeros((1, 3)), np.array([False]), np.array([curvature])
    )
    np.testing.assert_array_equal(matrix, hessian)


def test_held_states_after_the_section_is_stiffer_again_have_leaned_over():
    softness = np.array([0.7, 0.45, 0.3, -0.2, 0.9, 0.2, 0.45, 0.42, 0.6])
    hessian = np.stack([np.diag([x, 1.0, 1.5, -1.0, -1.0, -1.0]) for x in softness])
    held = np.array([0, 1, 1, 1, 1, 1, 1, 1, 0], dtype=bool)
    path = np.array(["a"] * 6 + ["b"] * 3)
    found = leaned_over(hessian, held, path)
    np.testing.assert_array_equal(found, [0, 0, 0, 0, 1, 1, 0, 0, 0])
