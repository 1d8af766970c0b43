"""The command that makes the rods' bounds from the truth of other layouts and writes them to files."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from calibration.cli import main
from calibration.truth import on_its_mesh, torsion_ratio
from rodmodel import read_calibration, save_calibration
from rodmodel.io import Adjustment, adjusted, find

SHIPPED = Path(rodmodel.__file__).parent / "calibrations"


def test_a_file_gets_its_bound_and_where_it_comes_from(tmp_path, capsys):
    file = tmp_path / "ring.json"
    shutil.copy(SHIPPED / "ring_pitch3.json", file)
    before = read_calibration(file)
    save_calibration(replace(before, bound=None), file)
    assert main(["bounds", str(file), "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["bounds"]
    after = read_calibration(file)
    bent = np.array(after.bound.bending_angle)
    angle, tip = after.bound.at(0.0, bending_angle=bent)
    np.testing.assert_allclose(row["bound"]["bending_angle_deg"], np.degrees(bent))
    np.testing.assert_allclose(row["bound"]["angle_deg"], np.degrees(angle))
    np.testing.assert_allclose(row["bound"]["tip_mm"], 1e3 * tip)
    note = after.provenance["bound"]
    assert note["command"] == f"rodmodel-calibrate bounds {file} --json"
    for name in ("truth_sha256", "mesh_limits_sha256"):
        assert re.fullmatch("[0-9a-f]{64}", note[name])
    assert "ring, pitch 3 mm" not in note["judge_states_of_other_layouts"]
    assert note["own_judge_states"]["states"] >= 3
    # Nothing else of the file has changed.
    assert (after.actuator, after.domain, after.error) == (before.actuator, before.domain, before.error)
    assert {k: v for k, v in after.provenance.items() if k != "bound"} == {
        k: v for k, v in before.provenance.items() if k != "bound"
    }


def test_a_law_gets_the_torsion_of_the_limit_once(tmp_path, capsys):
    file, shipped = tmp_path / "mine.json", read_calibration(SHIPPED / "six-helix_psi0_pitch3.json")
    save_calibration(on_its_mesh(shipped), file)
    for _ in range(2):
        assert main(["bounds", str(file), "--json"]) == 0
        (row,) = json.loads(capsys.readouterr().out)["bounds"]
        assert row["torsion_ratio"] == torsion_ratio(shipped)
        np.testing.assert_allclose(read_calibration(file).law.directions, shipped.law.directions, rtol=1e-14)


def test_what_cannot_have_such_a_bound_is_refused_and_stays(tmp_path, capsys):
    file = tmp_path / "mine.json"
    unchanged = Adjustment(1.0, np.ones(3), np.zeros(3), np.zeros(3))
    save_calibration(adjusted(find("ring", 0.0, 3e-3), unchanged, {}, {}), file)
    content = file.read_bytes()
    assert main(["bounds", str(file)]) == 2
    assert "got a law adjusted to measurements" in capsys.readouterr().err
    assert file.read_bytes() == content


@pytest.mark.parametrize("arguments", [["no-such-file.json"], ["--truth", "no-such-file.nc"]])
def test_a_missing_file_is_refused_in_one_line(arguments, capsys):
    assert main(["bounds", *arguments]) == 2
    told = capsys.readouterr().err
    assert "no-such-file" in told
    assert told.count("\n") == 1
