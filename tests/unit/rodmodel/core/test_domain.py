"""Where the compiled rod says that its calibration ends: pressures, and moments on any section."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import rodmodel
from rodmodel import CoreRod
from rodmodel.core import Result
from rodmodel.io import find
from tests.unit.rodmodel.sections import section_at

STEPS = 16


# A domain of a box and a sum.
PLAIN = {
    "pressure_max": (54e3, 53e3, 53e3),
    "pressure_sum_max": 100e3,
    "beside_share": 0.0,
    "beside_max": math.inf,
    "single_max": (0.0, 0.0, 0.0),
}


@pytest.fixture(scope="module")
def rod() -> CoreRod:
    return with_domain()


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


@pytest.mark.parametrize("name", ["tip_force", "follower_force", "distributed_force"])
def test_outside_are_forces_that_shear_a_section_far(rod: CoreRod, name: str) -> None:
    """Along the axis, so that there is no moment; with the reference's answer beside the core's."""
    pressure = [0.0, 0.0, 0.0]
    assert rod.actuator.shear_compliance > 0.0
    most = 0.2 / rod.actuator.shear_compliance
    # What the body carries is per its length.
    per = rod.actuator.body_length if name == "distributed_force" else 1.0
    for share, inside in ((0.98, True), (1.02, False)):
        force = np.array([0.0, 0.0, share * most / per])
        found = rod.solve(pressure, steps=STEPS, throw=False, **{name: force})
        assert found.converged
        assert found.in_domain is inside
        assert np.isfinite(found.error_estimate) == inside
        if name == "tip_force":
            other = rodmodel.load("double-helix").solve(np.array(pressure), throw=False, **{name: force})
            assert bool(other.in_domain) is inside


def test_outside_are_larger_moments_and_pressures(rod: CoreRod) -> None:
    found = rod.solve_many(steps=STEPS, **loaded(rod, 300))
    good = found["result"] == Result.successful
    inside = found["moment_share"] <= 1.0
    np.testing.assert_array_equal(found["in_domain"][good] != 0, inside[good])
    assert 0.2 < np.mean(inside[good]) < 0.8
    angle, tip = rod.error_bound.at(
        np.sum(loaded(rod, 300)["pressure"], axis=1),
        found["base_moment"],
        bending_angle=found["bending_angle"],
    )
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


def with_domain(**changes: Any) -> CoreRod:
    found = find("double-helix", 0.0, 3e-3)
    return CoreRod.of(replace(found, domain=replace(found.domain, **{**PLAIN, **changes})))


@pytest.mark.parametrize("share", [0.0, 4.0 / 7.0, 1.0])
def test_pressures_beside_each_other_are_inside_where_python_says_so(share: float) -> None:
    limited = with_domain(beside_share=share, beside_max=45e3)
    pressure = np.random.default_rng(5).uniform(0.0, 60e3, (4000, 3))
    # Some on the limit, where both have the same slack.
    total = pressure.sum(axis=1, keepdims=True)
    beside = (pressure + share * (total - pressure)).max(axis=1, keepdims=True)
    edge = (
        45e3 / beside * pressure * np.random.default_rng(6).choice([1.0, 1.0 + 1e-8, 1.0 + 1e-5], (4000, 1))
    )
    for pressures in (pressure, edge):
        rows = limited.solve_many(pressure=pressures)
        # A few bend so far that a moment or a step ends them.
        good = (rows["result"] == Result.successful) & (rows["moment_share"] <= 1.0)
        inside = np.asarray(limited.domain.covers_pressure(pressures.T))
        np.testing.assert_array_equal(rows["in_domain"][good] != 0, inside[good])
        assert 0.005 < np.mean(inside[good]) < 0.95
        assert np.mean(good) > 0.8


def test_no_limit_beside_is_none_in_the_core(rod: CoreRod) -> None:
    domain = rod.handle.rod.domain
    assert (domain.beside_share, domain.beside_max) == (0.0, 0.0)
    assert rod.solve([50e3, 50e3, 0.0]).in_domain


@pytest.mark.parametrize("changes", [{"beside_max": -1.0}, {"beside_share": float("nan"), "beside_max": 5e4}])
def test_a_limit_beside_that_is_none_is_refused(changes: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"beside_(max: got -1|share: got nan), expected 0 or more"):
        with_domain(**changes)


def test_the_limit_beside_is_told_where_it_is_passed() -> None:
    limited = with_domain(beside_share=0.5, beside_max=60e3)
    told = r"100000 Pa in sum, and 60000 Pa in each with 0.5 of the two others; throw=False"
    with pytest.raises(RuntimeError, match=told):
        limited.solve([50e3, 30e3, 0.0])


@pytest.mark.parametrize(
    "limits",
    [
        {"single_max": (70e3, 65e3, 0.0), "single_beside": 2e3},
        {"pressure_min": (0.0, 40e3, 0.0)},
    ],
)
def test_a_least_pressure_and_a_chamber_alone_are_those_of_the_domain(limits: dict) -> None:
    rod = with_domain(**limits)
    domain = rod.domain
    random = np.random.default_rng(4)
    pressure = 75e3 * random.random((400, 3)) * random.choice([0.02, 1.0], (400, 3))
    states = rod.solve_many(pressure=pressure, steps=STEPS)
    good = states["result"] == Result.successful
    expected = np.array([bool(domain.covers_pressure(p)) for p in pressure])
    inside = expected & (states["moment_share"] <= 1.0)
    np.testing.assert_array_equal(states["in_domain"][good] != 0, inside[good])
    assert 10 < np.sum(inside[good]) < np.sum(good) - 10
