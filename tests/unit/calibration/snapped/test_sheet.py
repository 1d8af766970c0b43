"""Sheets: axes, pressures, the way onto them, and paths over them."""

import math

import numpy as np
import pytest

from calibration.snapped import SnappedSheet, sheet_domain, snapped_paths, snapped_state
from fem_reference import CellError, Load
from tests.unit.calibration.manufactured_cell import free_curvature

ALL = [SnappedSheet(chamber, side) for chamber in (1, 2, 3) for side in (1, -1)]


@pytest.mark.parametrize("sheet", ALL)
def test_the_axes_are_those_of_its_chamber(sheet: SnappedSheet) -> None:
    """Chamber k lies at azimuth a = 120° (k − 1) and bends the rod away from there: about (sin a, −cos a)."""
    azimuth = 2.0 * math.pi / 3.0 * (sheet.chamber - 1)
    outwards = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    tip = np.cross(sheet.bending_axis, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(tip, -outwards, atol=1e-15)
    np.testing.assert_allclose(sheet.aside_axis, sheet.side * outwards, atol=1e-15)


@pytest.mark.parametrize("sheet", ALL)
def test_a_bend_aside_is_told_with_its_sign(sheet: SnappedSheet) -> None:
    for angle in (0.0, 0.3, -0.2):
        u = 40.0 * (math.cos(angle) * sheet.bending_axis + math.sin(angle) * sheet.aside_axis)
        assert sheet.aside(u) == pytest.approx(angle, abs=1e-12)


def test_pressures_are_numbered_from_the_chamber_on() -> None:
    assert SnappedSheet(1, 1).pressure(9.0, before=3.0, after=2.0) == (9.0, 2.0, 3.0)
    assert SnappedSheet(2, 1).pressure(9.0, before=1.0, after=3.0) == (1.0, 9.0, 3.0)
    assert SnappedSheet(3, 1).pressure(9.0, before=2.0, after=1.0) == (1.0, 2.0, 9.0)


@pytest.mark.parametrize(("chamber", "side"), [(0, 1), (4, 1), (1, 0), (1, 2)])
def test_another_chamber_or_side_is_refused(chamber: int, side: int) -> None:
    with pytest.raises(ValueError, match=r"(chamber|side): got "):
        SnappedSheet(chamber, side)


def test_the_way_onto_a_sheet_ends_without_a_moment() -> None:
    sheet = SnappedSheet(2, -1)
    loads = sheet.approach(70e3, 2e-4, 10)
    assert [load.pressure[1] for load in loads] == pytest.approx([*np.arange(7e3, 71e3, 7e3), 70e3])
    pushed = [load.moment is not None for load in loads]
    assert pushed == [False] * 4 + [True] * 6 + [False]
    np.testing.assert_allclose(loads[-2].moment, 2e-4 * sheet.aside_axis)


def paths(number: int = 15, **other: object):
    given = {"pressure": (53e3, 70e3), "beside": 15e3, "moment_axes": (3e-3, 3e-3, 1e-3), "seed": 0}
    return snapped_paths(SnappedSheet(2, 1), number=number, pressure_step=4e3, **{**given, **other})


def test_paths_stay_in_the_domain_and_go_down_in_short_steps() -> None:
    domain = sheet_domain(SnappedSheet(2, 1), (53e3, 70e3), 15e3, 3e-3, 1e-3)
    for path in paths():
        begin = Load((0.0, 70e3, 0.0))
        own = [begin.pressure[1], *(load.pressure[1] for load in path.loads)]
        assert np.all(np.diff(own) <= 1e-6)
        for load in path.loads:
            assert domain.covers_pressure(load.pressure)
            assert domain.covers_moment(load.moment)
            assert np.abs(np.subtract(load.pressure, begin.pressure)).max() <= 4e3 * (1.0 + 1e-9)
            begin = load


def test_a_leading_part_of_a_design_is_a_smaller_one_and_every_fifth_path_is_held_out() -> None:
    assert paths(15)[:7] == paths(7)
    assert [path.role for path in paths(10)] == (["train"] * 4 + ["held-out"]) * 2
    assert paths(15, seed=1) != paths(15)


def test_the_domain_has_the_chambers_least_pressure() -> None:
    domain = sheet_domain(SnappedSheet(3, 1), (53e3, 70e3), 15e3, 3e-3, 1e-3)
    assert domain.covers_pressure((15e3, 0.0, 60e3))
    assert not domain.covers_pressure((0.0, 0.0, 52e3))
    assert not domain.covers_pressure((0.0, 0.0, 71e3))
    assert not domain.covers_pressure((16e3, 0.0, 60e3))


def test_a_section_that_stands_upright_is_on_no_sheet() -> None:
    """The manufactured section never snaps."""
    from tests.unit.calibration.manufactured_cell import ManufacturedTracer

    sheet = SnappedSheet(1, 1)
    assert abs(sheet.aside(np.asarray(free_curvature(np.array([20e3, 0.0, 0.0]))))) < 0.05
    with pytest.raises(CellError, match=r"does not lean to side \+1 under 20000 Pa in chamber 1: .* aside"):
        snapped_state(upright(ManufacturedTracer()()), sheet, 20e3, 1e-4)


def upright(trace):
    """The continuation with zero moments in place of none."""

    def traced(loads, start):
        whole = [Load(load.pressure, load.moment or (0.0, 0.0, 0.0)) for load in loads]
        yield from trace(whole, start)

    return traced
