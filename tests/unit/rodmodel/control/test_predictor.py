"""The predictor: what it takes and gives, warm starts, threads."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rodmodel import CoreRod, Predictor

PRESSURE = np.array([40e3, 15e3, 5e3])
FORCE = np.array([0.01, -0.02, 0.005])
STEPS, TOLERANCE = 6, 1e-11


@pytest.fixture
def predictor(rod: CoreRod) -> Predictor:
    return rod.predictor(("tip_force",), steps=STEPS, tolerance=TOLERANCE)


def test_it_predicts_what_the_rod_solves(rod: CoreRod, predictor: Predictor) -> None:
    expected = rod.solve(PRESSURE, FORCE, steps=STEPS)
    for _ in range(2):  # cold, then warm
        found = predictor(PRESSURE, tip_force=FORCE)
        assert found.converged
        assert found.stable
        assert found.in_domain
        np.testing.assert_allclose(found.tip_position, expected.tip_position, atol=1e-12)
        np.testing.assert_allclose(found.tip_rotation, expected.tip_rotation, atol=1e-10)
        assert found.bending_angle == pytest.approx(expected.bending_angle, abs=1e-10)
        assert found.bending_plane == pytest.approx(expected.bending_plane, abs=1e-9)
        assert found.error_estimate == pytest.approx(expected.error_estimate, rel=1e-9)
        assert found.tip_error_estimate == pytest.approx(expected.tip_error_estimate, rel=1e-9)
        assert 0.0 < found.tip_error_estimate < 0.01


def test_bounds_are_not_a_number_beyond_what_is_calibrated(rod: CoreRod, predictor: Predictor) -> None:
    rows = np.stack([PRESSURE, 1.2 * np.array(rod.domain.pressure_max), 0.1 * PRESSURE])
    found = predictor(rows, tip_force=np.zeros((3, 3)))
    for bound in (found.error_estimate, found.tip_error_estimate):
        np.testing.assert_array_equal(np.isnan(bound), [False, True, False])
        # It grows with the pressures.
        assert bound[2] < bound[0]


def test_a_batch_is_its_rows_and_a_bad_row_is_flagged_alone(predictor: Predictor) -> None:
    rows = np.stack([PRESSURE, [np.nan, 0.0, 0.0], 0.5 * PRESSURE])
    found = predictor(rows, tip_force=FORCE)
    np.testing.assert_array_equal(found.converged, [True, False, True])
    assert np.all(np.isnan(found.tip_position[1]))
    for row in (0, 2):
        predictor.reset()
        alone = predictor(rows[row], tip_force=FORCE)
        np.testing.assert_array_equal(found.tip_position[row], alone.tip_position)


def test_results_do_not_change_when_the_next_call_is_made(predictor: Predictor) -> None:
    first = predictor(PRESSURE, tip_force=FORCE)
    kept = first.tip_position.copy(), first.tip_rotation.copy()
    predictor(0.3 * PRESSURE, tip_force=-FORCE)
    np.testing.assert_array_equal(first.tip_position, kept[0])
    np.testing.assert_array_equal(first.tip_rotation, kept[1])


def test_a_warm_start_after_a_jump_of_the_load_is_as_good_as_a_cold_one(predictor: Predictor) -> None:
    cold = predictor(PRESSURE, tip_force=FORCE)
    predictor(np.zeros(3), tip_force=-5.0 * FORCE)
    warm = predictor(PRESSURE, tip_force=FORCE)
    np.testing.assert_allclose(warm.tip_position, cold.tip_position, atol=1e-12)


def test_threads_share_a_predictor(rod: CoreRod, predictor: Predictor, pressures: np.ndarray) -> None:
    """Each answer is that of its own call: to the tolerance, as starts differ."""
    rows = pressures[:400]
    expected = rod.solve_many(pressure=rows, tip_force=FORCE, steps=STEPS)["tip_position"]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda row: predictor(row, tip_force=FORCE).tip_position, rows))
    np.testing.assert_allclose(found, expected, atol=1e-11)


def test_batches_are_the_same_on_two_threads(rod: CoreRod, pressures: np.ndarray) -> None:
    one, two = (
        rod.predictor(("gravity",), steps=3, threads=threads)(pressures, gravity=[0.0, 0.0, 9.81])
        for threads in (1, 2)
    )
    np.testing.assert_array_equal(one.tip_position, two.tip_position)
    assert np.all(one.converged)


def test_the_jacobian_is_that_of_differences(rod: CoreRod) -> None:
    """By the linearised equations with the same steps: of order 4, at 64 steps 1e-8 of the largest entry."""
    predictor = rod.predictor(("tip_force",), steps=64, tolerance=1e-13)
    _, found = predictor.jacobian(PRESSURE, tip_force=FORCE)

    def slope(of: str, by: str, size: float) -> np.ndarray:
        columns = []
        for axis in np.eye(3):
            total = 0.0
            # Of order 4: what it leaves out is 1e-9 of the slope, and rounding 1e-8.
            for factor, place in ((1.0, -2.0), (-8.0, -1.0), (8.0, 1.0), (-1.0, 2.0)):
                shift = place * size * axis
                p = PRESSURE + shift if by == "pressure" else PRESSURE
                f = FORCE + shift if by == "force" else FORCE
                total = total + factor * getattr(rod.solve(p, f, steps=64), of)
            columns.append(total / (12.0 * size))
        return np.stack(columns, axis=-1)

    for name, expected in {
        "position_by_pressure": slope("tip_position", "pressure", 10.0),
        "position_by_force": slope("tip_position", "force", 1e-5),
        "bend_by_pressure": slope("bend", "pressure", 10.0),
        "bend_by_force": slope("bend", "force", 1e-5),
    }.items():
        np.testing.assert_allclose(getattr(found, name), expected, atol=1e-6 * np.abs(expected).max())


def test_bad_arguments_are_named(rod: CoreRod, predictor: Predictor) -> None:
    with pytest.raises(ValueError, match="loads: got 'wind', expected any of tip_force"):
        Predictor(rod, ("wind",))
    with pytest.raises(ValueError, match=r"loads: got \[\], expected \['tip_force'\]"):
        predictor(PRESSURE)
    with pytest.raises(ValueError, match=r"pressure: got shape \(2,\), expected"):
        predictor(PRESSURE[:2], tip_force=FORCE)
    with pytest.raises(ValueError, match="steps: got 0, expected a whole number of 1 or more"):
        Predictor(rod, steps=0)
    for tolerance in (1.0, -1.0, np.nan):
        with pytest.raises(ValueError, match=f"tolerance: got {tolerance}, expected 0 to 0.01 rad"):
            Predictor(rod, tolerance=tolerance)
        with pytest.raises(ValueError, match=f"tolerance: got {tolerance}, expected 0 to 0.01 rad"):
            rod.solve_many(pressure=PRESSURE, tolerance=tolerance)
    with pytest.warns(DeprecationWarning, match="batch: nothing is compiled any more"):
        Predictor(rod, batch=(3,))
