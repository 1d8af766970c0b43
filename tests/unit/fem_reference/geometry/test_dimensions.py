"""Dimensions, loads and mesh levels: what cannot be is refused by name, what can be is what it says."""

import numpy as np
import pytest

from fem_reference import ActuatorGeometry, Load, PeriodCell
from fem_reference.mesh import LEVELS, MeshLevel, mesh_level

NAMES = (
    "body_diameter",
    "cavity_diameter",
    "outer_wall",
    "inner_wall",
    "partition_wall",
    "body_length",
    "cap_length",
    "winding_diameter",
)


def test_the_default_is_the_papers_actuator():
    geometry = ActuatorGeometry()
    assert geometry.chamber_inner_radius == pytest.approx(2.5e-3, rel=1e-12)
    assert geometry.chamber_outer_radius == pytest.approx(5e-3, rel=1e-12)
    # Sides run 0.8 mm beside the partitions' mid-lines at ±60°.
    for radius in (2.5e-3, 5e-3):
        beside = radius * np.sin(np.pi / 3.0 - geometry.chamber_half_angle(radius))
        assert beside == pytest.approx(0.8e-3, rel=1e-12)
    ring = np.pi / 4.0 * (12e-3**2 - 2e-3**2)
    assert geometry.body_area == pytest.approx(ring - 3.0 * geometry.chamber_area, rel=1e-12)


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [0.0, -1e-3, np.nan, np.inf, "1 mm", None])
def test_lengths_must_be_positive_and_finite(name, value):
    with pytest.raises(
        ValueError, match=f"^{name}: got {value!r}, expected a positive finite length in metres"
    ):
        ActuatorGeometry(**{name: value})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"outer_wall": 3.5e-3}, "outer_wall and inner_wall: got 3.5 mm and 1.5 mm"),
        ({"inner_wall": 4e-3}, "outer_wall and inner_wall: got 1 mm and 4 mm"),
        ({"partition_wall": 4.4e-3}, "partition_wall: got 4.4 mm, which closes the chambers"),
        ({"winding_diameter": 9.9e-3}, "winding_diameter: got 9.9 mm, expected between 10 and 12 mm"),
        ({"winding_diameter": 12e-3}, "winding_diameter: got 12 mm, expected between 10 and 12 mm"),
    ],
)
def test_walls_must_leave_chambers_and_hold_the_winding(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ActuatorGeometry(**arguments)


def test_a_thicker_outer_wall_makes_its_own_chamber_smaller():
    geometry, equal = ActuatorGeometry(outer_wall_variation=(0.1, 0.0, -0.2)), ActuatorGeometry()
    assert geometry.chamber_outer_radii == pytest.approx((4.9e-3, 5e-3, 5.2e-3), rel=1e-12)
    assert equal.chamber_outer_radii == (equal.chamber_outer_radius,) * 3
    # What a chamber loses is silicone: near enough its outer arc's length times the change of the radius.
    arcs = [2.0 * r * equal.chamber_half_angle(r) for r in (4.95e-3, 5.1e-3)]
    more = arcs[0] * 0.1e-3 - arcs[1] * 0.2e-3
    assert geometry.body_area - equal.body_area == pytest.approx(more, rel=1e-3)


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("value", [(0.1, 0.0), 0.1, (0.0, np.nan, 0.0), (-1.0, 0.0, 0.0)])
def test_a_variation_of_the_walls_is_three_parts(value):
    with pytest.raises(
        ValueError, match=r"^outer_wall_variation: got .* expected three finite numbers above -1"
    ):
        ActuatorGeometry(outer_wall_variation=value)


@pytest.mark.parametrize(
    ("variation", "message"),
    [
        ((0.0, 2.5, 0.0), "outer_wall and inner_wall: got 3.5 mm and 1.5 mm"),
        ((0.0, 0.0, -0.7), "winding_diameter: got 11.2 mm, expected between 11.4 and 12 mm"),
    ],
)
def test_walls_that_vary_must_leave_chambers_and_hold_the_winding(variation, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ActuatorGeometry(outer_wall_variation=variation)


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"pressure": (-1.0, 0.0, 0.0)},
            r"pressure: got \(-1.0, 0.0, 0.0\) Pa, expected none below 0 Pa",
        ),
        ({"pressure": (np.nan, 0.0, 0.0)}, r"pressure: got .*nan.*, expected three finite numbers \[Pa\]"),
        ({"pressure": (1e3, 2e3)}, r"pressure: got \(1000.0, 2000.0\), expected three finite numbers \[Pa\]"),
        (
            {"pressure": (0.0,) * 3, "moment": (0.0, np.inf, 0.0)},
            r"moment: got .*, expected three finite numbers \[N m\]",
        ),
        (
            {"pressure": (0.0,) * 3, "curvature": (1.0, 2.0)},
            r"curvature: got .*, expected three finite numbers \[1/m\]",
        ),
        (
            {"pressure": (0.0,) * 3, "moment": (0.0,) * 3, "curvature": (0.0,) * 3},
            "moment and curvature: got both",
        ),
    ],
)
def test_loads_must_be_three_finite_numbers_with_one_way_of_bending(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        Load(**arguments)


def test_an_unknown_mesh_level_is_refused_with_the_known_ones():
    with pytest.raises(
        ValueError,
        match=r"^elements: got 'absent', expected one of coarse, layered, medium, paper, quadratic, fine",
    ):
        mesh_level("absent")
    with pytest.raises(ValueError, match=r"^elements: got 'absent'"):
        PeriodCell(level="absent")


def test_a_level_of_counts_is_its_own():
    own = MeshLevel(2, 4, 2, 2, 1, 1, 1, 0.75)
    assert mesh_level(own) is own


def test_levels_refine_one_another():
    counts = [
        (level.inner_arc + level.partition_across) * level.inner_wall + level.around / level.axial_size
        for level in (mesh_level(name) for name in ("coarse", "medium", "paper"))
    ]
    assert counts[0] < counts[1] < counts[2]
    assert [name for name in LEVELS if mesh_level(name).order == 2] == ["quadratic", "fine", "finer"]
