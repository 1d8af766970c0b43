"""Stretches of a state of the cell: of a known deformation, and beside what the material's tests covered."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from fem_reference import LEVELS, CellState, Load, Ogden, PeriodCell, neo_hookean
from fem_reference.cell import extreme_stretches, largest_stretch, stretch_beyond_tests
from fem_reference.cli import main
from fem_reference.elements import SolidElements
from tests.fem_fixtures import TINY, TURN, distorted_block

ROOT = Path(__file__).parents[4]


def test_extremes_of_the_solid_are_those_of_a_homogeneous_deformation_however_it_is_turned():
    mesh = distorted_block(2)
    moved = mesh.points @ (TURN @ np.diag([1.7, 0.8, 1.1]) @ TURN.T).T
    assert SolidElements(mesh, Ogden()).extreme_stretches(moved) == pytest.approx((0.8, 1.7), rel=1e-12)


def cell(stretch_range: tuple[float, float] | None) -> PeriodCell:
    return PeriodCell(level=TINY, material=neo_hookean(1e5, stretch_range=stretch_range))


def stretched(cell: PeriodCell, stretch: float) -> CellState:
    """A state in name alone: all nodes follow a stretch along the rod, with the section as it was."""
    rest = cell.equations.rest()
    configuration = dataclasses.replace(
        rest, positions=rest.positions * [1.0, 1.0, stretch], strain=np.array([0.0, 0.0, 0.0, stretch])
    )
    return CellState(
        load=Load((0.0, 0.0, 0.0)),
        pressure=np.zeros(3),
        curvature=np.zeros(3),
        moment=np.zeros(3),
        stretch=stretch,
        energy=0.0,
        volume=np.zeros(3),
        hessian=np.zeros((6, 6)),
        iterations=0,
        residual=0.0,
        stable=None,
        negative_directions=None,
        jumped=False,
        configuration=configuration,
    )


def test_extremes_of_a_state_are_over_all_points_up_to_the_image_of_the_bottom_face():
    own = cell(None)
    assert extreme_stretches(own, stretched(own, 1.4)) == pytest.approx((1.0, 1.4), rel=1e-9)
    assert largest_stretch(own, stretched(own, 1.4)) == pytest.approx(1.4, rel=1e-9)


@pytest.mark.parametrize(
    ("tested", "stretch", "told"),
    [
        ((1.0, 1.3), 1.29, None),
        ((1.0, 1.3), 1.4, "a stretch of 1.4 in the silicone, which was tested up to 1.3"),
        # Planar tension up to 1.3 has 1/1.3 = 0.769 across.
        ((1.0, 1.3), 0.78, None),
        ((1.0, 1.3), 0.7, "a stretch of 0.7 in the silicone, which was tested down to 0.769"),
        ((0.6, 1.3), 0.7, None),
        (None, 1.9, None),
    ],
)
def test_a_state_beyond_the_tests_of_its_material_is_told(tested, stretch, told):
    own = cell(tested)
    assert stretch_beyond_tests(own, stretched(own, stretch)) == told


def test_the_command_warns_of_a_state_beyond_the_tests_of_its_material(tmp_path, monkeypatch, capsys):
    for name in LEVELS:
        monkeypatch.setitem(LEVELS, name, TINY)
    paper = (ROOT / "designs" / "paper.toml").read_text()
    assert "[material]\n" in paper
    design = tmp_path / "tested.toml"
    design.write_text(paper.replace("[material]\n", "[material]\nstretch_range = [1, 1.02]\n"))
    command = ["cell", "--elements", "coarse", "--pressure-kpa", "4", "1", "0", "--design"]
    assert main([*command, str(design)]) == 0
    assert "in the silicone, which was tested up to 1.02" in capsys.readouterr().err
    assert main([*command, str(ROOT / "designs" / "paper.toml")]) == 0
    assert "tested" not in capsys.readouterr().err
