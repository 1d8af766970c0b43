"""Chamber volumes of the compiled rod: of its sections, by another rule than the core's."""

import numpy as np
import pytest

from rodmodel import Calibration
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
    """The mean of the sections that bend, over the body; over the held length, what they have at rest.

    By Gauss' rule of 16 points; the core's is of order 10, its nodes' curvatures of order 4, at 128 steps.
    """
    rod = rod_with(calibration, held_length=held_length)
    a = rod.actuator
    solution = rod.solve(PRESSURE, **loads, steps=128)
    x, w = np.polynomial.legendre.leggauss(16)
    s = 0.5 * a.bending_length * (1.0 + x)
    volumes = [section_at(rod.handle, u, PRESSURE).volume for u in solution.curvature(s)]
    rest = section_at(rod.handle, np.zeros(3), np.zeros(3)).volume
    grown = 0.5 * w @ (np.array(volumes) - rest)
    expected = a.body_length * rest + (a.body_length - held_length) * grown
    np.testing.assert_allclose(solution.chamber_volume, expected, rtol=1e-9)


@pytest.mark.parametrize("steps", [1, 2, 3, 7, 9, 16])
def test_the_rule_is_exact_where_the_curvature_is_the_same_all_along(
    calibration: Calibration, steps: int
) -> None:
    rod = rod_with(calibration)
    arc = rod.solve(PRESSURE).chamber_volume
    stepped = rod.solve(PRESSURE, [0.0, 0.0, 0.0], steps=steps).chamber_volume
    np.testing.assert_allclose(stepped, arc, rtol=1e-12)


def test_under_loads_volumes_are_of_order_4(calibration: Calibration) -> None:
    """As the curvature at the nodes is; the rule itself adds less."""
    rod = rod_with(calibration)
    exact = rod.solve(PRESSURE, **LOADS, steps=256).chamber_volume
    errors = [
        np.abs(rod.solve(PRESSURE, **LOADS, steps=n).chamber_volume / exact - 1.0).max() for n in (16, 32, 64)
    ]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.1)
