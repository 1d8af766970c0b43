"""Where the compiled rod says that its calibration ends: pressures, and moments on any section."""

import numpy as np
import pytest

import rodmodel
from rodmodel import CoreRod
from rodmodel.core import Result
from tests.unit.rodmodel.sections import section_at

STEPS = 16


@pytest.fixture(scope="module")
def rod() -> CoreRod:
    return rodmodel.load_core("double-helix")


def loaded(rod: CoreRod, count: int) -> dict[str, np.ndarray]:
    """Pressures inside the domain, tip moments that leave it on either axis as often as not."""
    random = np.random.default_rng(9)
    moment = random.uniform(-1.0, 1.0, (count, 3)) * [6e-3, 6e-3, 4e-3]
    return {"pressure": random.uniform(0.0, 25e3, (count, 3)), "tip_moment": moment}


def test_the_largest_moment_is_that_of_the_nodes(rod: CoreRod) -> None:
    """Over the ellipsoid of the domain; moments change smoothly, so the nodes tell the largest."""
    given = loaded(rod, 20)
    found = rod.solve_many(steps=STEPS, **given)
    s = np.linspace(0.0, rod.actuator.bending_length, STEPS + 1)
    seen = []
    for row, record in enumerate(found):
        pressure, moment = given["pressure"][row], given["tip_moment"][row]
        solution = rod.solve(pressure, tip_moment=moment, steps=STEPS, throw=False)
        if not solution.converged:
            continue
        moments = np.array([section_at(rod.handle, u, pressure).moment for u in solution.curvature(s)])
        share = np.linalg.norm(moments / rod.domain.moment_axes, axis=1).max()
        assert record["moment_share"] == pytest.approx(share, rel=1e-9)
        seen.append(share)
    assert min(seen) < 0.9
    assert max(seen) > 1.1


def test_outside_are_larger_moments_and_pressures(rod: CoreRod) -> None:
    found = rod.solve_many(steps=STEPS, **loaded(rod, 300))
    good = found["result"] == Result.successful
    inside = found["moment_share"] <= 1.0
    np.testing.assert_array_equal(found["in_domain"][good] != 0, inside[good])
    assert 0.2 < np.mean(inside[good]) < 0.8
    angle, tip = rod.error_bound.at(np.sum(loaded(rod, 300)["pressure"], axis=1), found["base_moment"])
    for name, bound in (("angle_error", angle), ("tip_error", tip)):
        stated = np.where(found["in_domain"] != 0, bound, np.nan)
        np.testing.assert_allclose(found[name], stated, rtol=1e-14)

    largest = np.array(rod.domain.pressure_max)
    total = rod.domain.pressure_sum_max
    cases = [
        (np.diag(largest), True),
        (1.001 * np.diag(largest), False),
        (np.diag(largest) * (1 + 1e-9), True),
    ]
    pair = np.array([0.5 * total, 0.5 * total, 0.0])
    cases += [(pair[None], True), (pair[None] + [[0.0, 0.0, 10.0]], False)]
    for pressures, expected in cases:
        rows = rod.solve_many(pressure=pressures)
        assert np.all((rows["in_domain"] != 0) == expected)
