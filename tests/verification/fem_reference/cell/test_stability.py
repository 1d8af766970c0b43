"""What a state says of its stability is the inertia of the energy's whole Hessian."""

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import DoubleHelix, Load, PeriodCell, Ring, follow
from fem_reference.cell.unknowns import GAUGES
from fem_reference.solver import SolverOptions
from fem_reference.solver.options import ContinuationOptions
from tests.fem_fixtures import TINY

SLIDING = 0.23e-3
#: No body may slide: a state that is found is kept, be it a saddle.
KEPT = SolverOptions(continuation=ContinuationOptions(slide=0.0))


def kilopascals(*pressures: float) -> list[Load]:
    return [Load((1e3 * p, 0.0, 0.0)) for p in pressures]


def negative_eigenvalues(cell: PeriodCell, state, compliant: bool) -> int:
    """Of the dense Hessian in nodes, multipliers, stretch and curvature, less those of the multipliers."""
    equations = cell.equations
    linear = equations.linearise(state.configuration, np.asarray(state.pressure) / 1e6, exact=True)
    upper = equations.pattern.matrix(linear.data)
    nodes = (upper + sparse.triu(upper, 1).T).toarray()
    unknown = slice(0, 4 if compliant else 3)
    columns = linear.node_strain[:, unknown]
    whole = np.block([[nodes, columns], [columns.T, linear.strain_strain[unknown, unknown]]])
    return int((np.linalg.eigvalsh(whole) < 0.0).sum()) - GAUGES


@pytest.mark.parametrize("compliance", [0.0, SLIDING])
def test_negative_directions_are_those_of_the_whole_hessian(compliance):
    """On the smallest mesh the walls of two chambers press an edge on an edge in the plane of symmetry."""
    cell = PeriodCell(level=TINY, end_compliance=compliance, options=KEPT)
    for state, expected in zip(follow(cell, kilopascals(8, 20), jumps=False), (0, 1), strict=True):
        assert state.negative_directions == expected
        assert negative_eigenvalues(cell, state, compliance > 0.0) == expected
        assert state.stable is (expected == 0)
    # The curvature's own stiffness tells nothing of it: the walls lean inside a section that is held.
    assert np.linalg.eigvalsh(state.hessian[:3, :3]).min() > 0.0


def test_a_saddle_between_facets_is_left_for_the_minimum_beside_it():
    at = {}
    for options in (None, KEPT):
        cell = PeriodCell(level=TINY, end_compliance=SLIDING, options=options)
        *_, at[options] = follow(cell, kilopascals(8, 20), jumps=False)
    minimum, saddle = at[None], at[KEPT]
    assert minimum.stable
    assert minimum.negative_directions == 0
    assert not minimum.jumped
    assert minimum.energy < saddle.energy
    # Node by node no farther than `slide`; the bend changes by a thousandth.
    np.testing.assert_allclose(minimum.curvature[1], saddle.curvature[1], rtol=2e-3)


@pytest.mark.slow
def test_the_inertia_changes_at_no_pole_of_the_curvatures_stiffness():
    """Chamber 1 in its plane, coarse: lateral stiffness falls through zero at 59 kPa, and has a pole at 66.

    At the pole the nodes' own stiffness at fixed curvature turns over. The sum of both stays as it is.
    """
    cell = PeriodCell(level="coarse", end_compliance=SLIDING)
    softest = []
    for state in follow(cell, kilopascals(20, 40, 50, 55, 58, 60, 62, 64, 65, 65.5, 66, 68), jumps=False):
        below = bool(max(state.pressure) < 59e3)
        assert state.negative_directions == (0 if below else 1)
        # In contact's noise it is not known; it is never said to be stable.
        assert (state.stable is True) is below
        softest.append(np.linalg.eigvalsh(state.hessian[:3, :3]).min())
    assert softest[-3] < -1e-3 < 0.0 < softest[-2]


@pytest.mark.slow
@pytest.mark.parametrize("winding", [DoubleHelix(), Ring()], ids=["psi 0", "rings"])
@pytest.mark.parametrize("level", ["coarse", "medium", "paper", "quadratic"])
def test_a_path_that_may_not_jump_passes_where_single_nodes_slide(level, winding):
    """Both were said to lose their balance between 20 and 40 kPa on `medium`."""
    cell = PeriodCell(winding=winding, level=level, end_compliance=SLIDING)
    states = list(follow(cell, kilopascals(5, 20, 40), jumps=False))
    assert [state.jumped for state in states] == [False] * 3
    assert all(state.stable is not False for state in states)


@pytest.mark.slow
def test_a_path_that_may_not_jump_passes_where_a_long_step_fails():
    """Chambers 1 and 2, coarse: from 15 to 30 kPa a step of 2.8 kPa fails at 22, and was told as the end."""
    cell = PeriodCell(level="coarse", end_compliance=SLIDING)
    states = list(follow(cell, [Load((p, p, 0.0)) for p in (15e3, 30e3)], jumps=False))
    assert [state.jumped for state in states] == [False] * 2
    assert all(state.stable for state in states)
