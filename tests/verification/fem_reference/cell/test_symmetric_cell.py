"""A cell that keeps its plane of symmetry has the states of the whole cell that lie there."""

import numpy as np
import pytest

from fem_reference import DoubleHelix, Load, PeriodCell, Ring, follow
from tests.fem_fixtures import TINY

SLIDING = 0.23e-3
#: Projection of changes of (u, p) on those in the plane.
IN_PLANE = np.diag([0.0, 1.0, 0.0, 1.0, 0.5, 0.5])
IN_PLANE[4, 5] = IN_PLANE[5, 4] = 0.5
LOADS = [Load((8e3, 0.0, 0.0)), Load((8e3, 3e3, 3e3), moment=(0.0, 1e-3, 0.0))]


def cells(winding) -> tuple[PeriodCell, PeriodCell]:
    whole, half = (
        PeriodCell(winding=winding, level=TINY, end_compliance=SLIDING, symmetric=symmetric)
        for symmetric in (False, True)
    )
    return whole, half


@pytest.mark.parametrize("winding", [DoubleHelix(), Ring()])
def test_its_states_and_derivatives_are_those_of_the_whole_cell_in_the_plane(winding):
    """Newton's method ends at residuals of 1e-9 N; walls do not touch at these loads."""
    whole, half = cells(winding)
    assert half.unknowns < 0.6 * whole.unknowns
    for one, other in zip(follow(whole, LOADS), follow(half, LOADS), strict=True):
        np.testing.assert_allclose(other.curvature, one.curvature, rtol=1e-7, atol=1e-6)
        np.testing.assert_allclose(other.volume, one.volume, rtol=1e-8)
        np.testing.assert_allclose(other.energy, one.energy, rtol=1e-8)
        np.testing.assert_allclose(other.moment, one.moment, atol=1e-10)
        expected = IN_PLANE @ one.hessian @ IN_PLANE
        scale = np.sqrt(np.outer(np.diag(one.hessian), np.diag(one.hessian)).__abs__())
        np.testing.assert_allclose(other.hessian / scale, expected / scale, atol=1e-7)


def test_it_goes_on_from_a_state_of_the_whole_cell():
    whole, half = cells(DoubleHelix())
    start = whole.solve(LOADS[0])
    direct, reached = half.solve(LOADS[1]), next(iter(follow(half, LOADS[1:], start=start)))
    np.testing.assert_allclose(reached.curvature, direct.curvature, rtol=1e-7, atol=1e-6)


def test_it_is_at_a_minimum_where_the_whole_cell_leans_to_one_side():
    """On the smallest mesh an edge presses on an edge at 20 kPa: a saddle of the whole cell."""
    _, half = cells(DoubleHelix())
    state = half.solve(Load((20e3, 0.0, 0.0)))
    assert state.stable
    assert state.negative_directions == 0
    assert state.curvature[0] == state.curvature[2] == 0.0


@pytest.mark.parametrize(
    "load",
    [
        Load((1e3, 2e3, 0.0)),
        Load((0.0, 0.0, 0.0), moment=(1e-4, 0.0, 0.0)),
        Load((0.0, 0.0, 0.0), curvature=(0.0, 1.0, 2.0)),
    ],
)
def test_a_load_out_of_the_plane_is_refused(load):
    _, half = cells(DoubleHelix())
    with pytest.raises(ValueError, match="symmetric cell, expected equal pressures in chambers 2 and 3"):
        half.solve(load)


def test_a_winding_without_the_plane_is_refused():
    with pytest.raises(ValueError, match="symmetric: got a winding without it"):
        PeriodCell(winding=DoubleHelix(psi=0.2), level=TINY, symmetric=True)
