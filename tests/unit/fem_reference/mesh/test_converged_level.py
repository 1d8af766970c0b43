"""The mesh that a winding's cell gets when nobody names one."""

import pytest

from fem_reference import LEVELS, DoubleHelix, NoWinding, PeriodCell, Ring, SixHelix, converged_level


@pytest.mark.parametrize(
    ("winding", "name"),
    [(DoubleHelix(), "fine"), (SixHelix(), "fine"), (Ring(), "finer"), (NoWinding(), "coarse")],
)
def test_a_cell_takes_the_mesh_of_its_winding(winding, name):
    assert converged_level(winding) == name
    assert PeriodCell(winding=winding).level == LEVELS[name]


def test_a_level_that_is_named_is_taken():
    assert PeriodCell(winding=Ring(), level="coarse").level == LEVELS["coarse"]
    assert PeriodCell(winding=Ring(), level=LEVELS["medium"]).level == LEVELS["medium"]
