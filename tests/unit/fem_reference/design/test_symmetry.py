"""Symmetry of a design's section, by its winding and its walls; and what follows it."""

import math
from pathlib import Path

import numpy as np
import pytest

from calibration.from_design.actuator_runs import cases_for
from calibration.from_design.pressure_range import range_paths
from calibration.from_design.task import Budget, Task
from calibration.sweep import CellTracer
from fem_reference import ActuatorGeometry, Design, DoubleHelix, Load, NoWinding, PeriodCell, Ring, SixHelix
from fem_reference.geometry import Winding
from rodmodel import Domain
from tests.fem_fixtures import TINY


@pytest.mark.parametrize(
    ("winding", "walls", "symmetry"),
    [
        (Ring(), (0.0, 0.0, 0.0), "full"),
        (Ring(), (0.2, 0.2, 0.2), "full"),
        (SixHelix(), (0.0, 0.0, 0.0), "full"),
        (SixHelix(psi=0.1), (0.0, 0.0, 0.0), "none"),
        (NoWinding(), (0.0, 0.0, 0.0), "full"),
        (Ring(), (0.2, 0.0, 0.0), "mirror"),
        (Ring(), (0.0, 0.2, 0.0), "none"),
        (DoubleHelix(), (0.0, 0.0, 0.0), "mirror"),
        (DoubleHelix(), (-0.1, 0.2, 0.2), "mirror"),
        (DoubleHelix(), (0.2, 0.2, 0.0), "none"),
        (DoubleHelix(psi=0.5 * math.pi), (0.0, 0.0, 0.0), "mirror"),
        (DoubleHelix(psi=0.4), (0.0, 0.0, 0.0), "none"),
    ],
)
def test_a_section_is_as_symmetric_as_its_winding_and_its_walls(
    winding: Winding, walls: tuple[float, float, float], symmetry: str
) -> None:
    design = Design(winding=winding, geometry=ActuatorGeometry(outer_wall_variation=walls))
    assert design.symmetry == symmetry
    # Each chamber and pair that is no image of another is followed to its own range.
    assert len(range_paths(design)) == {"full": 2, "mirror": 4, "none": 6}[symmetry]


@pytest.mark.parametrize(
    ("winding", "walls", "chamber"),
    [
        (Ring(), (0.0, 0.0, 0.0), 1),
        (Ring(), (0.2, 0.0, 0.0), 1),
        (Ring(), (0.0, 0.2, 0.0), 2),
        (SixHelix(), (0.1, 0.1, 0.2), 3),
        (Ring(), (0.0, 0.1, 0.2), None),
        (SixHelix(psi=0.1), (0.0, 0.0, 0.0), None),
        (DoubleHelix(), (0.0, 0.2, 0.2), 1),
        # Chambers of a double helix are not alike, whatever their walls.
        (DoubleHelix(), (0.0, 0.2, 0.0), None),
        (DoubleHelix(psi=0.4), (0.0, 0.0, 0.0), None),
    ],
)
def test_a_chamber_has_the_plane_of_symmetry(
    winding: Winding, walls: tuple[float, float, float], chamber: int | None
) -> None:
    """Numbered 1, it makes the design symmetric."""
    design = Design(winding=winding, geometry=ActuatorGeometry(outer_wall_variation=walls))
    assert design.mirror_chamber == chamber
    if chamber is not None:
        first, second, third = (walls[(chamber - 1 + k) % 3] for k in range(3))
        geometry = ActuatorGeometry(outer_wall_variation=(first, second, third))
        assert Design(winding=winding, geometry=geometry).symmetry != "none"


@pytest.mark.parametrize("walls", [(0.2, 0.0, 0.0), (0.0, 0.2, 0.0)])
def test_chambers_bend_alike_where_the_symmetry_says_so(walls: tuple[float, float, float]) -> None:
    """Within rings, one wall a fifth thicker: in its own chamber, and in one of the two others."""
    design = Design(winding=Ring(), geometry=ActuatorGeometry(outer_wall_variation=walls))
    cell = PeriodCell.of(design, TINY)
    angles = [
        cell.solve(Load((*(5e3 * float(k == chamber) for k in range(3)),))).bending(60e-3)[0]  # type: ignore[arg-type]
        for chamber in range(3)
    ]
    alike = np.isclose(angles, np.roll(angles, -1), rtol=1e-4)
    # Of chambers 1 and 2, 2 and 3, 3 and 1.
    assert alike.tolist() == ([False, True, False] if walls[0] else [False, False, True])


@pytest.mark.parametrize(
    ("winding", "walls"),
    [
        (DoubleHelix(), (0.0, 0.0, 0.0)),
        (DoubleHelix(psi=math.pi), (0.0, 0.0, 0.0)),
        (DoubleHelix(psi=0.5 * math.pi), (0.0, 0.0, 0.0)),
        (SixHelix(psi=math.pi / 3.0), (0.0, 0.0, 0.0)),
        (SixHelix(psi=math.pi / 6.0), (0.0, 0.0, 0.0)),
        (Ring(), (0.0, 0.2, 0.0)),
        (NoWinding(), (0.1, 0.0, 0.0)),
    ],
)
def test_half_a_body_can_be_made_where_it_tells_the_whole(
    winding: Winding, walls: tuple[float, float, float]
) -> None:
    """At ψ = 90° the section is symmetric, but its body only after a shift: no half of it can be made."""
    design = Design(winding=winding, geometry=ActuatorGeometry(outer_wall_variation=walls))
    if design.mirror_in_place:
        whole, half = (PeriodCell.of(design, TINY, symmetric=in_plane).unknowns for in_plane in (False, True))
        assert 0.4 * whole < half < 0.6 * whole
        (state,) = CellTracer(design, TINY).in_plane()([Load((1e3, 0.0, 0.0))], None)  # type: ignore[misc]
        assert abs(state.curvature[0]) < 1e-9 * abs(state.curvature[1])
    else:
        assert CellTracer(design, TINY).in_plane() is None
        with pytest.raises(ValueError, match="symmetric: got"):
            PeriodCell.of(design, TINY, symmetric=True)
    task = Task(design, Budget.parse("20min"), Path(), "the command")
    runs = cases_for(task, Domain((20e3, 20e3, 20e3), 30e3, 1e-3))
    in_plane = [run for run in runs if run.name.endswith(("chamber1", "chambers23"))]
    assert in_plane
    assert {run.symmetric for run in in_plane} == {design.mirror_in_place}
