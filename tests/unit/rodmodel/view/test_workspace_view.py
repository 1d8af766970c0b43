"""What a workspace's samples say as JSON, as text and as a picture."""

from pathlib import Path

import numpy as np
import pytest

from rodmodel.control import Workspace
from rodmodel.view import plot_workspace, workspace_record, workspace_text
from tests.unit.rodmodel import calibrations


@pytest.fixture(scope="module")
def space() -> Workspace:
    """Samples of a made-up rod that bends by 1 mrad for each pascal away from the mean; one failed."""
    rng = np.random.default_rng(0)
    pressure = rng.uniform(0.0, 30e3, (400, 3))
    face = np.repeat(np.arange(4), 100)
    for chamber in range(3):
        pressure[face == chamber, chamber] = 0.0
    pressure[0] = 0.0
    azimuth = 2.0 * np.pi / 3.0 * np.arange(3)
    bend = 4e-5 * pressure @ np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    angle = np.linalg.norm(bend, axis=1)
    plane = np.mod(np.arctan2(bend[:, 1], bend[:, 0]), 2.0 * np.pi)
    tip = np.concatenate([-0.03 * bend, 0.06 * np.cos(angle)[:, None]], axis=1)
    converged = np.arange(400) != 7
    for values in (angle, plane, tip):
        values[~converged] = np.nan
    return Workspace(pressure, face, tip, angle, plane, converged, converged & (angle < 1.0))


def test_the_record_leaves_out_what_failed(space: Workspace) -> None:
    record = workspace_record(space)
    assert (record["samples"], record["not_converged"]) == (399, 1)
    assert record["in_domain"] == int(space.in_domain.sum())
    good = space.converged
    np.testing.assert_array_equal(record["tip_position_mm"], 1e3 * space.tip_position[good])
    np.testing.assert_array_equal(record["tip_min_mm"], np.min(record["tip_position_mm"], axis=0))
    np.testing.assert_array_equal(record["tip_max_mm"], np.max(record["tip_position_mm"], axis=0))


def test_the_plane_of_a_straight_sample_is_null(space: Workspace) -> None:
    record = workspace_record(space)
    assert record["bending_plane_deg"][0] is None
    assert None not in record["bending_plane_deg"][1:]


def test_farthest_bends_are_those_of_their_sectors(space: Workspace) -> None:
    record = workspace_record(space)
    farthest = record["farthest_bends"]
    assert len(farthest) == 24
    for towards, bend in zip(range(0, 360, 15), farthest, strict=True):
        away = np.mod(np.degrees(space.bending_plane) - towards + 180.0, 360.0) - 180.0
        near = space.converged & (np.abs(away) <= 7.5)
        assert bend["bending_angle_deg"] == np.degrees(space.bending_angle[near].max())
        assert bend["bending_plane_deg"] in record["bending_plane_deg"]


def test_the_text_has_units(space: Workspace) -> None:
    text = workspace_text(workspace_record(space))
    for wanted in ("samples", "399", "tip, most", "mm", "plane [deg]", "pressures [kPa]"):
        assert wanted in text


def test_the_picture_is_written(space: Workspace, tmp_path: Path) -> None:
    file = tmp_path / "space.png"
    plot_workspace(space, calibrations.ACTUATOR, file)
    assert file.read_bytes().startswith(b"\x89PNG")
