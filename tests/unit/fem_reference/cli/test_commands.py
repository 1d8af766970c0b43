"""The command `rodmodel-fem`: its answers, its files for ParaView, and one line for every bad input."""

import json

import meshio
import numpy as np
import pytest

from fem_reference import LEVELS, ActuatorGeometry, Design, design_text
from fem_reference.cli import main
from tests.fem_fixtures import TINY

KPA_8 = ["--pressure-kpa", "8", "0", "0"]
QUICK = ["cell", "--elements", "coarse", "--pressure-kpa", "4", "1", "0"]


def test_json_is_one_object_with_the_agreed_keys_and_the_vtk_file_opens(tmp_path, capsys):
    file = tmp_path / "cell.vtu"
    assert main([*QUICK, "--json", "--vtk", str(file)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {
        "bending_angle_deg",
        "bending_plane_deg",
        "chamber_volume_mm3",
        "converged",
        "curvature_per_m",
    } <= set(told)
    assert told["converged"] is True
    u1, u2, _ = told["curvature_per_m"]
    assert told["bending_angle_deg"] == pytest.approx(np.degrees(0.06 * np.hypot(u1, u2)), rel=1e-12)
    # Chamber 1 leads, chamber 2 follows: a plane between 0 and 60 degrees, and chamber 1 the fullest.
    assert 0.0 < told["bending_plane_deg"] < 30.0
    assert told["chamber_volume_mm3"] == sorted(told["chamber_volume_mm3"], reverse=True)

    written = meshio.read(file)
    cells = written.cells_dict
    assert len(cells["hexahedron"]) == told["elements"]
    assert len(cells["line"]) > 0
    # The winding's points lie on the winding's cylinder at rest.
    threads = np.unique(cells["line"])
    rest = written.points - written.point_data["displacement_mm"]
    np.testing.assert_allclose(np.hypot(*rest[threads, :2].T), 5.6, atol=1e-6)


@pytest.fixture
def tiny(monkeypatch):
    """Meshes of the fewest elements, which the command's flags do not offer."""
    for name in LEVELS:
        monkeypatch.setitem(LEVELS, name, TINY)


def test_ends_that_give_let_the_silicone_slide_and_bend_less(tiny, capsys):
    held, sliding = (
        main([*QUICK, "--json", *more]) or json.loads(capsys.readouterr().out)
        for more in ([], ["--end-compliance-mm-per-n", "0.23"])
    )
    assert held["stretch"] == pytest.approx(1.0, abs=1e-9)
    assert 1.0 < sliding["stretch"] < 1.01
    assert sliding["bending_angle_deg"] < held["bending_angle_deg"]


def test_the_imposed_curvature_is_taken(tiny, capsys):
    assert main(["cell", "--pressure-kpa", "0", "0", "0", "--curvature-per-m", "0", "-1", "0", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(told["curvature_per_m"], [0.0, -1.0, 0.0], atol=1e-12)
    # EI of the section is 2.4e-4 to 2.5e-4 N m² at rest, on any mesh and in the prototype.
    assert 0.23 < -told["moment_nmm"][1] < 0.26


@pytest.mark.parametrize(
    ("layout", "lines"), [(["ring", "--spacing-mm", "1"], 48), (["six-helix"], 96), (["none"], 0)]
)
def test_every_layout_is_taken_and_drawn(layout, lines, tmp_path, capsys):
    file = tmp_path / "cell.vtu"
    assert (
        main(
            [
                *["cell", "--elements", "coarse", "--pressure-kpa", "1", "0", "0", "--json", "--vtk"],
                str(file),
                "--layout",
                *layout,
            ]
        )
        == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert told["converged"] is True
    assert told["bending_angle_deg"] > 0.0
    assert len(meshio.read(file).cells_dict.get("line", [])) == lines


@pytest.mark.parametrize(
    ("arguments", "flag", "came"),
    [
        (["--pressure-kpa", "-1", "0", "0"], "--pressure-kpa", "-1000"),
        (["--pressure-kpa", "nan", "0", "0"], "--pressure-kpa", "nan"),
        (["--pressure-kpa", "1", "2"], "--pressure-kpa", "'1 2'"),
        (["--pressure-kpa", "500", "0", "0"], "--pressure-kpa", "500000"),
        ([*QUICK[1:], "--psi-deg", "abc"], "--psi-deg", "'abc'"),
        ([*QUICK[1:], "--pitch-mm", "0"], "--pitch-mm", "0.0"),
        ([*QUICK[1:], "--inner-wall-mm", "5"], "--outer-wall-mm and --inner-wall-mm", "5 mm"),
        ([*QUICK[1:], "--partition-wall-mm", "6"], "--partition-wall-mm", "6 mm"),
        ([*QUICK[1:], "--outer-wall-variation", "0.1", "0"], "--outer-wall-variation", "'0.1 0'"),
        ([*QUICK[1:], "--outer-wall-variation", "-2", "0", "0"], "--outer-wall-variation", "-2.0"),
        ([*QUICK[1:], "--layout", "knitted"], "--layout", "'knitted'"),
        ([*QUICK[1:], "--layout", "ring", "--spacing-mm", "0.1"], "--spacing-mm", "0.1 mm"),
        ([*QUICK[1:], "--spacing-mm", "1"], "--spacing-mm", "1 mm"),
        ([*QUICK[1:], "--layout", "ring", "--psi-deg", "30"], "--psi-deg", "the layout ring"),
        (
            [*QUICK[1:], "--layout", "ring", "--pitch-mm", "3", "--spacing-mm", "1"],
            "--pitch-mm",
            "--spacing-mm",
        ),
        ([*QUICK[1:], "--layout", "ring", "--spacing-mm", "few"], "--spacing-mm", "'few'"),
        ([*QUICK[1:], "--layout", "six-helix", "--pitch-mm", "0.5"], "--pitch-mm", "0.5 mm"),
        ([*QUICK[1:], "--elements", "huge"], "--elements", "'huge'"),
        ([*QUICK[1:], "--end-compliance-mm-per-n", "-0.2"], "--end-compliance-mm-per-n", "-0.0002"),
        ([*QUICK[1:], "--vtk", "no/such/folder/cell.vtu"], "--vtk", "no/such/folder"),
        ([*QUICK[1:], "--plot", "no/such/folder/cell.png"], "--plot", "no/such/folder"),
        ([*QUICK[1:], "--plot", "cell.txt"], "--plot", "'cell.txt'"),
        ([*QUICK[1:], "--moment-nmm", "0", "1", "0", "--curvature-per-m", "0", "1", "0"], "moment", "both"),
    ],
)
def test_bad_input_exits_2_with_one_line(arguments, flag, came, capsys):
    assert main(["cell", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("rodmodel-fem: ")
    assert flag in line
    assert came in line
    assert "expected" in line


@pytest.mark.parametrize(("share", "came"), [("0", "0.0"), ("2", "2.0"), ("soft", "'soft'")])
def test_an_impossible_thread_is_refused_by_its_flag(share, came, capsys):
    assert main(["actuator", "--pressure-kpa", "1", "0", "0", "--slack-share", share]) == 2
    out, told = capsys.readouterr()
    assert out == ""
    assert f"--slack-share: got {came}" in told


@pytest.mark.parametrize(
    ("arguments", "came"),
    [
        (["--pressure-kpa", "0", "1", "0"], "pressure=(0.0, 1000.0, 0.0)"),
        (["--pressure-kpa", "1", "0", "0", "--psi-deg", "30"], "a winding without it"),
        (
            ["--pressure-kpa", "1", "0", "0", "--outer-wall-variation", "0", "0.1", "0"],
            "a geometry without it",
        ),
    ],
)
def test_a_plane_of_symmetry_that_is_not_there_is_refused(arguments, came, tiny, capsys):
    assert main(["actuator", *arguments, "--symmetric"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("rodmodel-fem: --symmetric: got ")
    assert came in line
    assert "expected" in line


def test_the_actuator_writes_every_load_step_as_a_series(tiny, tmp_path, capsys):
    """On a short body of few elements."""
    short, file = tmp_path / "short.toml", tmp_path / "path.pvd"
    short.write_text(design_text(Design(geometry=ActuatorGeometry(body_length=3e-3, cap_length=2e-3))))
    assert main(["actuator", "--design", str(short), *KPA_8, "--json", "--vtk", str(file)]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["converged"]
    parts = sorted(tmp_path.glob("path_*.vtu"))
    assert [part.name in file.read_text() for part in parts] == [True, True]
    # The last part is the state that is told.
    mesh = meshio.read(parts[-1])
    assert mesh.point_data["displacement_mm"].max() > 0.0
    top = mesh.points[np.isclose((mesh.points - mesh.point_data["displacement_mm"])[:, 2], 5.0, atol=1e-9)]
    np.testing.assert_allclose(top.mean(axis=0), record["tip_position_mm"], atol=0.05)
