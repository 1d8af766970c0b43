"""Silicone that slides along the rod as far as the ends give: the potential's slopes, and what bounds it."""

import numpy as np
import pytest

from fem_reference import CellState, Load, PeriodCell
from tests.fem_fixtures import TINY, difference, load_of, relative_error

COMPLIANCE = 0.23e-3  # [m/N]
PRESSURE = (20e3, 12e3, 0.0)  # [Pa]
LENGTH = 60e-3  # [m]


def cell(compliance: float) -> PeriodCell:
    return PeriodCell(level=TINY, end_compliance=compliance)


@pytest.fixture(scope="module")
def free() -> tuple[PeriodCell, CellState]:
    sliding = cell(COMPLIANCE)
    return sliding, sliding.solve(Load(PRESSURE))


def energy_and_moment(state: CellState) -> np.ndarray:
    return np.array([state.energy, *state.moment])


def test_the_chambers_push_the_silicone_along_the_rod(free):
    """The ends hold the rod's pull k (λ − 1): about the pressures on the chambers' areas, 0.7 N here."""
    _, state = free
    pull = LENGTH / COMPLIANCE * (state.stretch - 1.0)
    area = sum(PRESSURE) * state.volume.mean()
    assert 0.5 * area < pull < 2.0 * area


def test_moment_and_volumes_are_the_slopes_of_the_potential(free):
    # Newton leaves 1e-9 N mm; steps of 0.02 1/m and 20 Pa lose (1e-3)⁴ of their range.
    sliding, state = free

    def at(curvature: np.ndarray, pressure: np.ndarray) -> CellState:
        return sliding.solve(load_of(pressure, curvature=curvature), start=state)

    here = state.curvature, np.array(PRESSURE)
    for i, e in enumerate(np.eye(3)):
        slope = difference(lambda t, e=e: energy_and_moment(at(here[0] + t * e, here[1])), 0.05)
        assert abs(state.moment[i] - slope[0]) <= 1e-5 * np.linalg.norm(state.hessian[:3, :3] @ here[0])
        assert relative_error(state.hessian[i, :3], slope[1:]) <= 1e-4
    for k, e in enumerate(np.eye(2, 3)):
        slope = difference(lambda t, e=e: energy_and_moment(at(here[0], here[1] + t * e)), 50.0)
        assert state.volume[k] == pytest.approx(-float(slope[0]), rel=1e-5)
        assert relative_error(state.hessian[:3, 3 + k], slope[1:]) <= 1e-4


def test_the_potential_falls_with_the_compliance_as_the_envelope_theorem_says(free):
    """∂Π/∂k = (λ − 1)²/2 at fixed curvature and pressure, the spring k being the only one to change."""
    _, state = free

    def energy(stiffness: float) -> float:
        load = load_of(PRESSURE, curvature=state.curvature)
        return cell(LENGTH / stiffness).solve(load, start=state).energy

    stiffness = LENGTH / COMPLIANCE
    slope = difference(lambda t: energy(stiffness + t), 0.02 * stiffness)
    assert float(slope) == pytest.approx(0.5 * (state.stretch - 1.0) ** 2, rel=1e-4)


def test_ends_that_give_little_hold_the_length(free):
    held = cell(0.0).solve(Load(PRESSURE))
    stiff = cell(1e-3 * COMPLIANCE).solve(Load(PRESSURE))
    assert held.stretch == pytest.approx(1.0, abs=1e-12)
    # A thousandth of the stretch, and of its effect on the curvature.
    _, state = free
    assert stiff.stretch - 1.0 == pytest.approx(1e-3 * (state.stretch - 1.0), rel=0.1)
    change = np.linalg.norm(state.curvature - held.curvature)
    assert np.linalg.norm(stiff.curvature - held.curvature) <= 2e-3 * change


@pytest.mark.parametrize("compliance", [-1e-3, np.nan, np.inf])
def test_a_compliance_that_is_none_is_refused(compliance):
    with pytest.raises(
        ValueError, match=r"end_compliance: got .*, expected a finite number \[m/N\], not negative"
    ):
        PeriodCell(level=TINY, end_compliance=compliance)
