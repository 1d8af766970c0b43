"""The commands beside `predict`: inverse, workspace, layouts and export."""

import json
import math
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import rodmodel
from rodmodel.cli import main
from rodmodel.cli._inverse import not_reached

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3


def test_inverse_and_predict_undo_each_other(command: Any) -> None:
    _, out, _ = command("predict", "--pressure-kpa", "30", "12", "0", "--json")
    pose = json.loads(out)
    bend = ["--bending-angle-deg", f"{pose['bending_angle_deg']}"]
    bend += ["--bending-plane-deg", f"{pose['bending_plane_deg']}"]
    tip = ["--tip-position-mm", *(f"{x:.9f}" for x in pose["tip_position_mm"])]
    for target, distance in ((bend, "distance_deg"), (tip, "distance_mm")):
        status, out, err = command("inverse", *target, "--json")
        assert (status, err, out.count("\n")) == (GOOD, "", 1)
        record = json.loads(out)
        assert list(record)[:4] == ["pressure_kpa", "reached", distance, "nearest"]
        # The inverse stays on the loading branch.
        of_branch = {"snapped_by_chamber", "snapped_side", "other_branch_possible"}
        assert set(pose) - of_branch - {"pressure_factor_to_end_of_branch"} < set(record)
        assert record["reached"]
        assert record["converged"]
        assert abs(record[distance]) < 0.06
        np.testing.assert_allclose(record["pressure_kpa"], [30.0, 12.0, 0.0], atol=0.1)
        np.testing.assert_allclose(record["tip_position_mm"], pose["tip_position_mm"], atol=0.1)
    status, out, _ = command("inverse", *bend)
    assert status == GOOD
    assert out.startswith("pressures")
    assert "kPa" in out


def test_a_target_out_of_reach_has_its_status_and_the_nearest(command: Any) -> None:
    status, out, err = command("inverse", "--tip-position-mm", "0", "0", "80", "--json")
    assert status == NO_CONVERGENCE
    record = json.loads(out)
    assert (record["reached"], record["converged"]) == (False, True)
    assert 13.9 < record["distance_mm"] < 14.1
    assert err.count("\n") == 1
    assert ("out of reach: the above comes nearest" in err) == record["nearest"]
    assert "14 mm away" in err


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"nearest": True}, "out of reach: the above comes nearest and stays 3 deg away"),
        ({"nearest": False}, "not reached: the above stays 3 deg away"),
        ({"nearest": False, "converged": False}, "no convergence: the search ended 3 deg away"),
        ({"result": "unstable"}, "no convergence: under the loads the rod has no equilibrium"),
    ],
)
def test_nearest_is_said_only_where_it_is_known(found: dict[str, Any], said: str) -> None:
    record = {"result": "successful", "converged": True, "distance_deg": 3.0, **found}
    told = not_reached(record)
    assert told.startswith(said)
    assert ": take " in told
    assert ("nearest" in told) == (found.get("nearest") is True)


def test_workspace_tells_how_far_the_rod_gets(command: Any, tmp_path: Path) -> None:
    picture = tmp_path / "space.png"
    status, out, err = command("workspace", "--samples", "400", "--json", "--plot", str(picture))
    assert (status, err, out.count("\n")) == (GOOD, "", 1)
    record = json.loads(out)
    count = record["samples"]
    assert count == pytest.approx(400, rel=0.15)
    assert record["in_domain"] == count
    for name in ("pressure_kpa", "tip_position_mm", "bending_angle_deg", "bending_plane_deg"):
        assert len(record[name]) == count
    np.testing.assert_allclose(record["tip_max_mm"], np.max(record["tip_position_mm"], axis=0))
    farthest = max(record["farthest_bends"], key=lambda bend: bend["bending_angle_deg"])
    assert farthest["bending_angle_deg"] == max(record["bending_angle_deg"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    status, out, _ = command("workspace", "--samples", "400")
    assert status == GOOD
    for wanted in ("samples", "tip, most", "mm", "plane [deg]", "kPa"):
        assert wanted in out


def test_layouts_lists_what_ships(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(import_module("rodmodel.io.loading"), "_SHIPPED", file.parent)
    for bad in file.parent.glob("*.json"):
        if bad != file:
            bad.unlink()
    assert main(["layouts"]) == GOOD
    out = capsys.readouterr().out
    for wanted in ("double-helix", "3 mm", "every 60 deg", "70, 60, 60 kPa", "1.2 N mm", "0.92"):
        assert wanted in out
    assert main(["layouts", "--json"]) == GOOD
    (record,) = json.loads(capsys.readouterr().out)["calibrations"]
    assert record["layout"] == "double-helix"
    np.testing.assert_allclose(record["pressure_max_kpa"], [70, 60, 60])
    assert math.isclose(record["error"]["bending_angle_deg"]["p95"], math.degrees(0.016))


@pytest.fixture
def export(file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run `rodmodel export` with an exporter that notes what it is told: status, stderr, the notes."""

    def run(*arguments: str, fails: bool = False) -> tuple[int, str, list[tuple[float, Path, bool]]]:
        told: list[tuple[float, Path, bool]] = []

        def write(found: rodmodel.io.Found, folder: Path, *, single_precision: bool) -> None:
            told.append((found.psi, folder, single_precision))
            if fails:
                raise PermissionError(13, "Permission denied")

        monkeypatch.setitem(sys.modules, "rodmodel.core.export", SimpleNamespace(export=write))
        status = main(["export", "--calibration", str(file), *arguments])
        return status, capsys.readouterr().err, told

    return run


def test_export_writes_the_layout_that_was_asked_for(export: Any) -> None:
    assert export("--out", "folder") == (GOOD, "", [(0.0, Path("folder"), False)])
    status, _, told = export("--out", "folder", "--psi-deg", "120", "--float")
    assert (status, told) == (GOOD, [(math.radians(120), Path("folder"), True)])


def test_an_export_that_cannot_be_written_is_told_in_one_line(export: Any) -> None:
    status, err, _ = export("--out", "folder", fails=True)
    assert status == BAD_INPUT
    assert err.startswith("rodmodel: --out: got 'folder' (Permission denied), expected a directory")
    status, err, told = export()
    assert (status, told) == (BAD_INPUT, [])
    assert "--out" in err
