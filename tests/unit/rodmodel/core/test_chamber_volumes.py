"""Chamber volumes of the compiled rod: of its sections, by another rule than the core's."""

import numpy as np
import pytest

from rodmodel import Calibration, CoreRod
from rodmodel.io import find
from tests.unit.rodmodel.sections import rod_with, section_at

PRESSURE = np.array([25e3, 12e3, 4e3])
LOADS = {"tip_force": [0.01, -0.015, -0.005], "tip_moment": [2e-4, -1e-4, 3e-4], "gravity": [3.0, -5.0, -7.0]}


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return find("double-helix", 0.0, 3e-3).calibration


@pytest.mark.parametrize("held_length", [0.0, 4e-3, 0.03])
@pytest.mark.parametrize("loads", [{}, LOADS], ids=["arc", "loaded"])
def test_volumes_are_those_of_the_sections(
    calibration: Calibration, loads: dict[str, list[float]], held_length: float
) -> None:
    """Those of the sections that bend; of the stiff tip's, free of moments; at rest over the held length.

    And the work of the loads on the ends, which the pressures move: by differences of unloaded rods, order 4
    at 30 Pa. The sections by Gauss' rule of 16 points; the core's is of order 10, its nodes' curvatures of
    order 4, at 256 steps.
    """
    rod = rod_with(calibration, held_length=held_length)
    a = rod.actuator
    solution = rod.solve(PRESSURE, **loads, steps=256)
    x, w = np.polynomial.legendre.leggauss(16)
    s = 0.5 * a.bending_length * (1.0 + x)
    volumes = [section_at(rod.handle, u, PRESSURE).volume for u in solution.curvature(s)]
    rest = section_at(rod.handle, np.zeros(3), np.zeros(3)).volume
    free = section_at(rod.handle, rod.solve(PRESSURE).curvature(0.0), PRESSURE).volume
    expected = 0.5 * a.bending_length * w @ np.array(volumes)
    expected = expected + (a.stiff_tip - held_length) * free + held_length * rest
    moment = section_at(rod.handle, solution.curvature(0.0), PRESSURE).moment
    force = np.array(loads.get("tip_force", [0.0] * 3)) + a.cap_mass * np.array(
        loads.get("gravity", [0.0] * 3)
    )
    push = solution.tip_rotation.T @ force
    for chamber in range(3):
        slope, aside = ends_slope(rod, chamber)
        turn = 0.5 * (slope - slope.T)
        expected[chamber] += moment @ [turn[2, 1], turn[0, 2], turn[1, 0]] + push @ aside
    np.testing.assert_allclose(solution.chamber_volume, expected, rtol=1e-9)


def ends_slope(rod: CoreRod, chamber: int) -> tuple[np.ndarray, np.ndarray]:
    """By a chamber's pressure: of the first section's frame, in it, and of the cap's offset."""
    a, step = rod.actuator, 30.0

    def ends(n: int) -> tuple[np.ndarray, np.ndarray]:
        u = (arc := rod.solve(PRESSURE + n * step * np.eye(3)[chamber])).curvature(0.0)
        size = a.tip_offset / np.hypot(a.tip_offset_curvature, np.hypot(u[0], u[1]))
        return arc.frames(0.0), np.array([-size * u[1], size * u[0], -a.tip_draw * (u[0] ** 2 + u[1] ** 2)])

    (r1, o1), (r2, o2), (r3, o3), (r4, o4) = map(ends, (1, -1, 2, -2))
    slope = (8.0 * (r1 - r2) - (r3 - r4)) / (12.0 * step)
    return ends(0)[0].T @ slope, (8.0 * (o1 - o2) - (o3 - o4)) / (12.0 * step)


@pytest.mark.parametrize("steps", [1, 2, 3, 7, 9, 16])
def test_the_rule_is_exact_where_the_curvature_is_the_same_all_along(
    calibration: Calibration, steps: int
) -> None:
    rod = rod_with(calibration)
    arc = rod.solve(PRESSURE).chamber_volume
    stepped = rod.solve(PRESSURE, [0.0, 0.0, 0.0], steps=steps).chamber_volume
    np.testing.assert_allclose(stepped, arc, rtol=1e-12)


def test_under_loads_volumes_are_of_order_4(calibration: Calibration) -> None:
    """As the curvature at the nodes is; the rule itself adds less.

    At 64 steps they err by 2e-11, less than the solves' usual tolerance lets through.
    """
    rod = rod_with(calibration)
    given = {"pressure": PRESSURE, **LOADS, "volumes": True, "tolerance": 1e-13}
    exact, *rough = (rod.solve_many(steps=n, **given)["chamber_volume"][0] for n in (256, 16, 32, 64))
    errors = [np.abs(volume / exact - 1.0).max() for volume in rough]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.1)
