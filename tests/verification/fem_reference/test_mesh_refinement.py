"""The cell's free bending angle settles under mesh refinement; `tests.benchmark.bench_mesh` draws it."""

import numpy as np
import pytest

from fem_reference import LEVELS, Load, PeriodCell, follow
from tests.benchmark.bench_mesh import refined

PRESSURES = (2.5e3, 5e3, 10e3, 15e3)


@pytest.mark.slow
def test_angles_change_less_from_one_mesh_to_the_next():
    """Every count times 1, 1.5 and 2, at 5 and 15 kPa: the coarse mesh is within 3 % of the finest.

    The segments of the thread change with the mesh and bring a scatter of their own, so no order is claimed,
    only that the second change is smaller than the first.
    """
    angles = []
    for factor in (1.0, 1.5, 2.0):
        cell = PeriodCell(level=refined(LEVELS["coarse"], factor))
        states = list(follow(cell, [Load((p, 0.0, 0.0)) for p in PRESSURES]))
        angles.append([abs(states[k].curvature[1]) for k in (1, 3)])
    coarse, middle, fine = np.array(angles)
    assert np.all(np.abs(fine - middle) < np.abs(middle - coarse))
    assert np.all(np.abs(coarse / fine - 1.0) < 0.03)


def test_the_medium_mesh_is_near_the_papers():
    """Both have eight layers a pitch; 18 and 24 elements on a chamber's outer arc, in place of 12, differ.

    Around, the angle converges at second order to 2.3 % more than with 12 (docs/cell.md): 18 leave 1.0 %, 24
    leave 0.6, and other counts move it by 0.2.
    """
    loads = [Load((p, 0.0, 0.0)) for p in (5e3, 20e3)]
    medium, paper = (
        np.array([s.curvature[1] for s in follow(PeriodCell(level=level), loads)])
        for level in ("medium", "paper")
    )
    np.testing.assert_allclose(medium, paper, rtol=0.006)
