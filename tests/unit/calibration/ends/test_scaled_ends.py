"""Ends of another actuator: those of a similar one are found, scaled; its cells are of its design."""

import numpy as np
import pytest
import xarray as xr

from calibration.ends import cell_bending as cells
from calibration.ends import fit as ends
from fem_reference import Design, Load, design_text, follow
from rodmodel import Actuator
from tests.fem_fixtures import TINY
from tests.similar_designs import scaled
from tests.unit.calibration.truth import test_compare_rods as paper

LENGTH, MODULUS = 2.5, 0.25
DESIGN = scaled(Design(), LENGTH, MODULUS)


def truth_of_similar() -> xr.Dataset:
    """The planted runs, all lengths times 2.5 and all pressures by four."""
    truth = paper.truth_of()
    for name, factor in (
        ("pressure", MODULUS),
        ("tip_position", LENGTH),
        ("volume", LENGTH**3),
        ("middle_curvature", 1.0 / LENGTH),
    ):
        truth[name] = factor * truth[name]
    return truth.assign_attrs(design=design_text(DESIGN))


def test_the_ends_of_a_similar_actuator_are_the_same_scaled(monkeypatch):
    """To the tolerance of the least squares, relative; the search takes as many steps as the paper's."""

    def bending(chosen, compliance):
        # A compliance goes as one over modulus and length.
        curvature = 1.01 * (1.0 - 10.0 * MODULUS * LENGTH * compliance) * paper.CURVATURE / LENGTH
        stiffness = MODULUS * LENGTH**4 * paper.STIFFNESS
        return ends.Bending(curvature, np.full(len(curvature), 1.01), LENGTH**2 * paper.VOLUME, stiffness)

    monkeypatch.setattr(ends, "cell_bending", bending)
    found = ends.fit_ends(truth_of_similar(), LENGTH * paper.BODY, LENGTH * paper.CAP, 0.0)
    factors = {
        "base_turn": 1.0 / MODULUS,
        "base_lag": LENGTH,
        "stiff_tip": LENGTH,
        "tip_offset": LENGTH,
        "tip_offset_curvature": 1.0 / LENGTH,
        "base_growth": 1.0,
    }
    planted = {name: factors[name] * value for name, value in paper.PLANTED.items()}
    planted |= {"tip_draw": 1e-9 * ends.DRAW * LENGTH**3}
    planted |= {"base_stiffness": MODULUS * LENGTH**4 * paper.AT_REST}
    planted |= {"held_length": LENGTH * paper.HELD}
    assert found.values == pytest.approx(planted, rel=1e-6)


@pytest.mark.parametrize("stuck", [0, 1])
def test_the_better_of_two_searches_gives_the_ends(stuck, monkeypatch):
    """One search ends where it began: at the paper's ends, or at none."""
    search, begun = ends.least_squares, []

    def may_stick(residual, start, bounds):
        begun.append(start)
        stay = {"max_nfev": 1} if len(begun) % 2 == stuck else {}
        return search(residual, start, bounds=bounds, **stay)

    monkeypatch.setattr(ends, "least_squares", may_stick)
    cell = ends.Bending(
        1.01 * paper.CURVATURE, np.full(len(paper.CURVATURE), 1.01), paper.VOLUME, paper.STIFFNESS
    )
    monkeypatch.setattr(ends, "cell_bending", lambda chosen, compliance: cell)
    found = ends.fit_ends(paper.truth_of(), paper.BODY, paper.CAP, 0.0)
    assert len(begun) > 2
    assert found.values["base_turn"] == pytest.approx(paper.PLANTED["base_turn"], rel=1e-4)
    assert found.after < 1e-3 * found.before


def test_states_of_little_bending_do_not_take_the_ends_to_infinity(monkeypatch):
    """The cap's offset is linear in the curvature there: its slope is told, and not where it ends."""
    truth, share = paper.truth_of().isel(state=[0, 1, 2]), 0.01
    rows = [0, 1, 2]
    curvature = share * paper.CURVATURE[rows]
    tip, axis = ends.tip_between_ends(
        curvature,
        share * paper.PRESSURE[rows],
        paper.SOFTNESS[rows],
        paper.BODY,
        paper.CAP,
        **{**paper.PLANTED, **paper.FIXED, "tip_offset": 2.0, "tip_offset_curvature": 8e3},
    )
    truth["pressure"] = (("state", "chamber"), share * paper.PRESSURE[rows])
    truth["tip_position"] = (("state", "axis"), tip)
    truth["tip_rotation"] = (("state", "row", "column"), np.stack([0.0 * axis, 0.0 * axis, axis], axis=2))
    cell = cells.Bending(curvature, np.ones(3), paper.VOLUME[:4], paper.STIFFNESS[:4])
    monkeypatch.setattr(ends, "cell_bending", lambda chosen, compliance: cell)
    found = ends.fit_ends(truth, paper.BODY, paper.CAP, 0.0)
    assert abs(found.values["tip_offset"]) <= 6e-3
    assert found.after < 0.1 * found.before
    assert np.isfinite(list(found.standard_errors.values())).all()


def test_the_cells_of_runs_are_of_their_design(monkeypatch):
    """Of its material and dimensions, on the mesh of the runs, with the compliance that is tried."""
    made = []

    def cell_of(design, level, compliance, symmetric):
        made.append((design, level, compliance))
        raise InterruptedError

    monkeypatch.setattr(cells.PeriodCell, "of", cell_of)
    with pytest.raises(InterruptedError):
        cells.cell_bending(truth_of_similar(), 0.1e-3)
    (design, _, compliance) = made[0]
    # Numbers of a text have twelve digits or more.
    assert design.geometry.body_diameter == pytest.approx(DESIGN.geometry.body_diameter, rel=1e-12)
    assert design.material.shear_modulus == pytest.approx(DESIGN.material.shear_modulus, rel=1e-12)
    assert compliance == 0.1e-3


def test_a_cell_that_keeps_its_plane_has_the_response_of_a_free_one(monkeypatch):
    """Curvature and stiffness in the plane of chamber 1, below where a free cell leaves it."""
    asked = []
    make = cells.PeriodCell.of

    def cell_of(design, level, compliance, symmetric=False):
        asked.append(symmetric)
        return make(design, TINY, compliance, symmetric=symmetric)

    monkeypatch.setattr(cells.PeriodCell, "of", cell_of)
    truth = paper.truth_of().isel(state=[0, 4])
    truth["case"] = (("state",), np.array(["chamber1-fit", "pair23-fit"], dtype=object))
    truth["pressure"] = (("state", "chamber"), np.array([[12e3, 0.0, 0.0], [0.0, 9e3, 9e3]]))
    found = cells.cell_bending(truth, 0.1e-3)
    assert asked == [True, True, False]
    free = make(Design(), TINY, 0.1e-3)
    for row, pressure in enumerate(truth["pressure"].values):
        (state,) = follow(free, [Load(tuple(pressure))])
        # Both are solved to the cell's tolerance.
        np.testing.assert_allclose(found.curvature[row], state.curvature, atol=1e-5 * abs(state.curvature[1]))
        turn = np.linalg.pinv(found.stiffness[row + 1]) @ [0.0, 1.0, 0.0]
        expected = np.linalg.inv(state.hessian[:3, :3]) @ [0.0, 1.0, 0.0]
        np.testing.assert_allclose(turn, expected, atol=1e-4 * expected[1])


def test_ends_that_fit_best_with_a_tip_of_negative_length_have_none(monkeypatch):
    """No actuator has such a tip, and the calibration file would refuse it once all is computed."""
    truth = paper.truth_of()
    bent = {**paper.PLANTED, **paper.FIXED, "stiff_tip": -0.5e-3}
    curvature = 1.01 * paper.CURVATURE
    tip, axis = ends.tip_between_ends(
        curvature, paper.PRESSURE, paper.SOFTNESS, paper.BODY, paper.CAP, **bent
    )
    truth["tip_position"] = (("state", "axis"), tip)
    truth["tip_rotation"] = (("state", "row", "column"), np.stack([0.0 * axis, 0.0 * axis, axis], axis=2))
    cell = cells.Bending(curvature, np.full(len(curvature), 1.01), paper.VOLUME, paper.STIFFNESS)
    monkeypatch.setattr(ends, "cell_bending", lambda chosen, compliance: cell)
    found = ends.fit_ends(truth, paper.BODY, paper.CAP, 0.0)
    assert 0.0 <= found.values["stiff_tip"] < 1e-6
    assert found.after < 0.3 * found.before
    Actuator(paper.BODY, paper.CAP, 12e-3, 0.1, 1e-3, **found.values)
